"""stub"""
from neumat.brdf.validity import directional_albedo
import math
def largest_albedo(material):
    return max(float(directional_albedo(material, math.radians(a), 64).max()) for a in (5,45,70,80,85))
