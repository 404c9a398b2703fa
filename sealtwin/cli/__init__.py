"""The command line. Each group of commands has its own file."""
