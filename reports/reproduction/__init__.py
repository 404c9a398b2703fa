"""The reproduction of the paper: its study on the reconstructed trial, its claims held against ours."""
