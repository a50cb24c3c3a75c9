"""What pictures say themselves of the conventions that they are read by: the cosine of the light, and which way is up.

Pictures are seen once, block by block, as they are read.
"""

import math

import torch

STEEPEST = math.radians(85)  # no ring beyond is believed
OBLIQUE, NEAR_NORMAL = math.radians(45), math.radians(20)
CURL = 0.2  # correlations below say nothing
LIGHTS = (math.radians(5), math.radians(65))  # theta of those that slopes are found from


class Witness:
    """Gathers means over rings of lights, and the slopes of the surface, from a set of pictures.

    light, view (s, 3): directions of the pictures; side: theirs, texels.
    """

    def __init__(self, light, view, side):
        self.theta = torch.acos(light[:, 2].double().clamp(-1, 1))
        self.light = light
        self.means = torch.zeros(len(light), dtype=torch.float64)
        top = (view == view[view[:, 2].argmax()]).all(-1)
        usable = (self.theta > LIGHTS[0]) & (self.theta < LIGHTS[1]) & (view[:, 2] > math.cos(NEAR_NORMAL))
        self.slopes = top & usable
        self.gram, self.projected = torch.zeros(3, 3), torch.zeros(3, side, side)

    def add(self, part, pictures):
        """Take the pictures (n, side, side, 3) of a slice, as the files hold them, rows along +y."""
        self.means[part] = pictures.mean((1, 2, 3), dtype=torch.float64)
        chosen = self.slopes[part]
        if chosen.any():
            light = self.light[part][chosen]
            self.gram += light.T @ light
            self.projected += torch.einsum("nk,nhw->khw", light, pictures[chosen].mean(-1))

    def fall_off(self):
        """Return (theta of the most oblique ring, radians; its mean over that of the ring nearest to the normal).

        None where there is no ring between 45 and 85 degrees, none within 20 of the normal, or nothing but black.
        """
        oblique = self.theta[(self.theta >= OBLIQUE) & (self.theta <= STEEPEST)]
        nearest = self.theta.min()
        if not len(oblique) or nearest > NEAR_NORMAL:
            return None
        ring, reference = (self.means[(self.theta - t).abs() < 0.01].mean() for t in (oblique.max(), nearest))
        return (float(oblique.max()), float(ring / reference)) if reference > 0 else None

    def upright(self):
        """Return the correlation that is above 0 where rows run along +y, below 0 where they run along -y.

        Slopes of a height have no curl: d(dh/dx)/dy = d(dh/dy)/dx. Both are found from the pictures of the view nearest
        to the normal by photometric stereo (Woodham 1980), as if it were Lambertian, and of a wrong axis the signs
        differ. 0 where they can't be told.
        """
        if int(self.slopes.sum()) < 6 or not self.gram.isfinite().all() or torch.linalg.cond(self.gram) > 1e4:
            return 0.0
        x, y, z = torch.linalg.solve(self.gram, self.projected.flatten(1)).reshape(self.projected.shape)
        known = z > 1e-3 * z.max()
        by_x, by_y = (torch.where(known, slope / z.clamp_min(1e-9), 0.0).clamp(-2, 2) for slope in (x, y))
        first, second = torch.diff(by_x, dim=0)[:, 1:], torch.diff(by_y, dim=1)[1:]
        pair = torch.stack([first.flatten(), second.flatten()])
        return float(torch.nan_to_num(torch.corrcoef(pair)[0, 1]))

    def contradictions(self, cosine):
        """Return texts, each of what the pictures contradict: that they contain the cosine or don't, and their rows."""
        found, fall_off, upright = [], self.fall_off(), self.upright()
        if fall_off:
            theta, ratio = fall_off
            expected = math.cos(theta) if cosine else 1.0
            if (ratio < math.sqrt(math.cos(theta))) != cosine:
                assumed = "contain" if cosine else "don't contain"
                found.append(
                    f"taken to {assumed} the cosine of the light, but lights at {math.degrees(theta):.0f} degrees give "
                    f"{ratio:.2f} times what lights near the normal give, not about {expected:.2f}: "
                    f"see the option cosine"
                )
        if upright < -CURL:
            found.append(
                f"the shading says that rows run the other way (correlation {upright:.2f}): see the option rows"
            )
        return found
