"""neumat: synthesis of measured-looking materials."""

import os

# MKL may round a matrix that lies elsewhere in memory otherwise (on AMD's processors it does), and a material's fit
# would depend on its neighbours. Read at MKL's first call; costs a twentieth of a fit's time.
os.environ.setdefault("MKL_CBWR", "AUTO,STRICT")
