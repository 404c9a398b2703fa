"""Make trials and a catalogue from a lab's folder of photos and sheets."""
