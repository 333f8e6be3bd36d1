"""Files of recordings: CSV, NPZ, MAT, Parquet, HDF5 and bags of ROS, as far as they are bounded."""
