"""What a level holds, how two of them differ, and what it takes before that may show anything."""
