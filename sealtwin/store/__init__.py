"""What is kept: files, run folders, databases."""
