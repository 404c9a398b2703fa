"""A second reality."""
