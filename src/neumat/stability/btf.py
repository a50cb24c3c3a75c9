"""Where BTFs break: captures, fits and synthesis at their limits, each with a bar, and what guards their users.

Cases of representations are in `stability.btf_fits` and `stability.btf_inputs`, on captures of `stability.btf_bench`;
cases of synthesis in `stability.btf_synthesis`.
"""

from neumat.stability.btf_fits import fit_cases
from neumat.stability.btf_inputs import input_cases
from neumat.stability.btf_synthesis import synthesis_cases
from neumat.stability.stress import stress_table


def stability_table(bench, progress=iter):
    """Return the `stress_table` of a BtfBench."""
    synthesis = synthesis_cases(bench.ours.positional(), bench.seed, bench.queries)
    return stress_table([*fit_cases(bench), *input_cases(bench), *synthesis], bench.folder, progress)
