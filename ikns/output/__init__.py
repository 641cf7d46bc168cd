"""What is written: files and folders that overwrite nothing, JSON, and sentences."""
