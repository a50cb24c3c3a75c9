"""The training loop of every iterative model here. Its budget is a number of steps: same config, same numbers."""

import contextlib
import json
import math

import torch

from neumat.errors import NeumatError
from neumat.files import atomic_path, reading
from neumat.seeds import seed_for, torch_generator

CHECKPOINT_EVERY = 500  # steps; does not change the numbers


def device():
    """Return the CUDA device where there is one, else the CPU."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


@contextlib.contextmanager
def seeded(seed, *names):
    """Seed torch's own generator, which initial weights and dropout draw from; put it back afterwards."""
    devices = [torch.cuda.current_device()] if torch.cuda.is_available() else []
    with torch.random.fork_rng(devices):
        torch.manual_seed(seed_for(seed, *names))
        yield


def bfloat16_pays(on):
    """Return whether matrix products in bfloat16 are faster than in float32 on that device.

    Of CPUs those with a matrix unit (amx_bf16), and AMD's with avx512_bf16: a training takes 0.58 of the time there
    (Zen 4). Intel's avx512_bf16 without a matrix unit is no help: 1.45 of the time (both measured with torch 2.13).
    """
    if on.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    with contextlib.suppress(OSError), open("/proc/cpuinfo") as file:
        cpu = file.read()
        return "amx_bf16" in cpu or ("AuthenticAMD" in cpu and "avx512_bf16" in cpu)
    return False


def autocast(precision, on):
    """Return the autocast context of precision "float32", "bfloat16" or "auto" (bfloat16 where it pays)."""
    if precision not in ("auto", "float32", "bfloat16"):
        raise NeumatError("precision", "auto, float32 or bfloat16", precision)
    wanted = precision == "bfloat16" or (precision == "auto" and bfloat16_pays(on))
    return torch.autocast(on.type, torch.bfloat16, enabled=wanted)


def learning_rate(step, steps, lr, lr_end, warmup):
    """Linear warm-up over `warmup` steps, then a half cosine from lr to lr_end at the last step."""
    if step < warmup:
        return lr * (step + 1) / warmup
    phase = (step - warmup) / max(1, steps - warmup)
    return lr_end + (lr - lr_end) * (1 + math.cos(math.pi * phase)) / 2


def train(
    network, loss, *, steps, lr, seed, progress, checkpoint, identity,
    lr_end=0.0, warmup=100, ema=0.999, weight_decay=0.0, precision="auto",
):  # fmt: skip
    """Train `network` by AdamW on loss(generator) for `steps` steps; leave the averaged weights in it.

    Every step's randomness comes from the seed and the step's number, so a run that resumes from `checkpoint` (a
    path or None; ignored where `identity`, a JSON-able config, is not the one that wrote it) gives the numbers of
    an uninterrupted one. ema: decay of the average, reached as (1 + step) / (10 + step).
    Raises NeumatError where the loss stops being finite.
    """
    on = next(network.parameters()).device
    parameters = list(network.parameters())
    optimizer = torch.optim.AdamW(parameters, lr=lr, weight_decay=weight_decay, betas=(0.9, 0.99), fused=True)
    average = [p.detach().clone() for p in parameters]
    identity = json.dumps([identity, seed, steps], sort_keys=True)
    first = 0
    if checkpoint and checkpoint.exists():
        with reading(checkpoint, "a checkpoint of a training (remove it to begin anew)"):
            saved = torch.load(checkpoint, map_location=on, weights_only=True)
            if saved["identity"] == identity:
                first = saved["step"]
                network.load_state_dict(saved["network"])
                optimizer.load_state_dict(saved["optimizer"])
                average = saved["average"]
    network.train()
    with seeded(seed):
        for step in progress(range(first, steps)):
            torch.manual_seed(seed_for(seed, "dropout", step))
            for group in optimizer.param_groups:
                group["lr"] = learning_rate(step, steps, lr, lr_end, warmup)
            with autocast(precision, on):  # entered anew each step: it caches the weights it has cast
                value = loss(torch_generator(seed, "step", step))
            optimizer.zero_grad()
            value.backward()
            torch.nn.utils.clip_grad_norm_(parameters, 1.0)
            optimizer.step()
            decay = min(ema, (1 + step) / (10 + step))
            with torch.no_grad():
                for mean, parameter in zip(average, parameters, strict=True):
                    mean.lerp_(parameter, 1 - decay)
            if (step + 1) % CHECKPOINT_EVERY == 0:
                if not math.isfinite(value.item()):
                    raise NeumatError(f"training step {step}", "a finite loss", value.item())
                if checkpoint:
                    state = {
                        "identity": identity, "step": step + 1, "network": network.state_dict(),
                        "optimizer": optimizer.state_dict(), "average": average,
                    }  # fmt: skip
                    with atomic_path(checkpoint) as temporary:
                        torch.save(state, temporary)
    with torch.no_grad():
        for mean, parameter in zip(average, parameters, strict=True):
            parameter.copy_(mean)
    if not all(torch.isfinite(parameter).all() for parameter in parameters):
        raise NeumatError("the end of a training", "finite weights", "NaN or infinite ones")
    network.eval()
    if checkpoint:
        checkpoint.unlink(missing_ok=True)
