import pytest

from neumat.render.lobes import SAMPLERS
from neumat.reporting.noise_chart import LABELS, noise_chart
from neumat.studies.bsdf_sampling import noise_sweep


@pytest.mark.usefixtures("compiled")
def test_noise_falls_with_the_samples_and_with_fitted_lobes(ladder, tmp_path):
    table = noise_sweep({"matte": ("a", ladder["matte"]), "glossy": ("b", ladder["glossy"])}, [4, 64])
    assert set(table["sampler"]) == {*SAMPLERS, "measured"} == set(LABELS)
    psnr = table.set_index(["kind", "sampler", "spp"])["psnr"]
    assert (psnr.xs(64, level="spp") > psnr.xs(4, level="spp")).all()
    assert psnr["glossy", "fitted", 64] > psnr["glossy", "cosine", 64] + 10
    # Lobes would save a matte material next to nothing, and cost it stratification: the pictures are the same.
    assert psnr["matte", "fitted", 64] == pytest.approx(psnr["matte", "cosine", 64], abs=1e-6)
    noise_chart(table, tmp_path / "bsdf")
    assert {path.name for path in tmp_path.iterdir()} == {"bsdf.png", "bsdf.svg"}
