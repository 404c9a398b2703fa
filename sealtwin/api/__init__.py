"""The functions and classes that ``import sealtwin`` offers. They call the stages."""
