"""Files of recordings: CSV, NPZ, MAT and Parquet, read and written."""
