"""neumat: synthesis of measured-looking materials."""
