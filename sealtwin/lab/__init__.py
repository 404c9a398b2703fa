"""Makes trials and a catalogue of a lab's folder of photos, sheets and notes."""
