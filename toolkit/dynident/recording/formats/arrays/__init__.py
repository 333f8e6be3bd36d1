"""Files of named arrays and tables: NPZ, MAT, Parquet, HDF5, also of several records."""
