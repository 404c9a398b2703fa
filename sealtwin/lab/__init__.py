"""A lab's folder of photos, sheets and notes, turned into trials and a catalogue of them."""
