"""Statistics of a calibration: what levels that were read say of settings that were not measured. No run is made."""
