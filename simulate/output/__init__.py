"""Files of a fluid run: checkpoints, frames, health and statistics."""
