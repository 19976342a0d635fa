"""What comes of a calibration: the calibrated machine file, and two of them compared."""
