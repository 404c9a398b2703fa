"""Many runs of a trial, and what they say together."""
