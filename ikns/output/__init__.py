"""What is written: files and folders that overwrite nothing, and strict JSON."""
