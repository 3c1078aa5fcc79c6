"""Reading files: tables of measurements, from CSV or Parquet."""
