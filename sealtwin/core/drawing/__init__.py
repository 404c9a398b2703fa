"""Pictures of records that more than one stage shows."""
