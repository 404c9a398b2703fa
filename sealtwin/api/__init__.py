"""The functions and classes that ``import sealtwin`` offers, in terms of the stages beneath."""
