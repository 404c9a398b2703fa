"""What several runs show side by side: a study as the paper draws it, and runs in comparison."""
