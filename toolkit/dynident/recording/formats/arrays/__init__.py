"""Files of named arrays and tables: NPY, NPZ, MAT, Parquet, HDF5, also of several records."""
