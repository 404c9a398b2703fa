"""Many runs of a trial, or many photos, and what they say together."""
