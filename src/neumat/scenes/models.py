"""The ladder: models of one material, from the cheapest to the dearest.

| rung | numbers | what it is |
|---|---|---|
| lambert | 3 | a diffuse material |
| glossy | 7 | a diffuse base under one GGX lobe |
| sgd | 33 | the shifted gamma distribution of microfacets, per channel (Bagher et al. 2012) |
| field-4, -8, -10, -12, -16, -21 | 63, 155, 213, 279, 435, 675 | neural fields of that width (Sztrajman et al. 2021) |
| table | 4374000 | the values on the MERL grid |
"""

from dataclasses import dataclass
from hashlib import sha256

import torch

from neumat.brdf.analytic import SGD, SGD_PARAMETERS, Glossy, Lambert
from neumat.brdf.merl import write_merl
from neumat.brdf.table import Table
from neumat.fields.field import Field
from neumat.fields.layout import widths_of
from neumat.render.lobes import write_lobes

WIDTHS = {f"field-{width}": width for width in (4, 8, 10, 12, 16, 21)}
*SMALLER, WIDEST = WIDTHS
ANALYTIC_SHARE = 5  # analytic models take as many times fewer training steps than fields
ANALYTIC = ("lambert", "glossy", "sgd")


@dataclass(frozen=True)
class Model:
    """A rung's model of a material: its numbers (n,), float32, and the seconds of CPU time that its fit took."""

    rung: str
    numbers: torch.Tensor
    seconds: float = 0.0

    @classmethod
    def of_table(cls, table, seconds=0.0):
        """Return the Model of a Table."""
        return cls("table", torch.where(table.valid[:, None], table.values, torch.nan).flatten(), seconds)

    @property
    def bytes(self):
        """Return what the numbers take, 4 bytes each."""
        return 4 * self.numbers.numel()

    @property
    def material(self):
        """Return the material, with eval(theta_h, theta_d, phi_d) -> (n, 3), 1/sr."""
        x = self.numbers
        if self.rung == "lambert":
            return Lambert(x)
        if self.rung == "glossy":
            return Glossy(x[:3], x[3:6], x[6])
        if self.rung == "sgd":
            return SGD(dict(zip(SGD_PARAMETERS, x.double().view(-1, 3), strict=True)))
        return Table(x.view(-1, 3)) if self.rung == "table" else Field(x, widths_of(len(x)))

    def plugin(self, folder, lobes=None):
        """Return the Mitsuba dictionary of the model; a table is written into `folder`, a Path, first.

        lobes: shares of `neumat.render.lobes.fit_lobes` by which directions are drawn; None means the model's own.
        """
        drawn = {} if lobes is None else {"lobes": write_lobes(lobes)}
        if self.rung == "lambert" and lobes is None:
            return {"type": "diffuse", "reflectance": {"type": "rgb", "value": self.numbers.tolist()}}
        if self.rung == "table":
            path = folder / f"{sha256(self.numbers.numpy().tobytes()).hexdigest()[:16]}.binary"
            if not path.exists():
                write_merl(path, self.numbers.view(-1, 3).numpy())
            return {"type": "merl", "filename": str(path)} | drawn
        plugin, key = (self.rung, "parameters") if self.rung in ANALYTIC else ("nbrdf", "weights")
        return {"type": plugin, key: " ".join(repr(float(number)) for number in self.numbers)} | drawn
