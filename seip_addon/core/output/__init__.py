"""What the program writes: records, tables, pictures, reports and datasets."""
