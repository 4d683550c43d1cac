"""Charts: time, frequency, responses, poles and zeros, paths, spectra."""
