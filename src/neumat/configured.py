"""Methods that a config names: dataclasses whose fields are their hyperparameters, in a registry by name."""

from dataclasses import fields

from neumat.errors import NeumatError


class Configured:
    """A dataclass that a config's hyperparameters make."""

    @classmethod
    def from_config(cls, config):
        """Return one with these hyperparameters (dict). Raises NeumatError for an unknown one."""
        known = [field.name for field in fields(cls)]
        for key in config:
            if key not in known:
                raise NeumatError(cls.__name__, f"one of {', '.join(known) or 'no hyperparameters'}", key)
        return cls(**config)


def configured(registry, what, name, config=None):
    """Return the method `name` of a registry {name: Configured class} with the hyperparameters `config` (dict) in place
    of its defaults.

    what: a method in words. Raises NeumatError for an unknown name or hyperparameter.
    """
    if name not in registry:
        raise NeumatError(what, f"one of {', '.join(registry)}", name)
    return registry[name].from_config(config or {})
