"""Files of recordings: CSV, NPY, NPZ, MAT, Parquet, HDF5, bags of ROS, as far as bounded."""
