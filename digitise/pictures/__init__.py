"""What a photo's file holds, and pictures in memory."""
