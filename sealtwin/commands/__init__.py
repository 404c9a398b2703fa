"""What a user can ask for, one idea to a file: parse, call, print."""
