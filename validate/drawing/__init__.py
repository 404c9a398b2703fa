"""One trial as figures: curves, sections, pictures and the fill in three dimensions, all in one look."""
