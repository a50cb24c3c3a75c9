"""BTFs in Dr.Jit, for compiled variants of Mitsuba: the same values as PyTorch gives, from the same tensors."""
