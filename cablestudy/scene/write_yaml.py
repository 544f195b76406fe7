"""Plain values -> YAML text that `strict_yaml.compose` reads back as the same values."""

import yaml

from cablestudy.scene.strict_yaml import resolve

WIDTH = 120


class _Dumper(yaml.SafeDumper):
    """Text that YAML 1.2 would take for a number, a truth value or null is quoted; nothing is an alias."""

    def ignore_aliases(self, data):
        return True


def _text(dumper, text):
    plain = isinstance(resolve(text), str)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if plain else '"')


_Dumper.add_representer(str, _text)


def write_yaml(value):
    """YAML text of plain mappings, lists, text and numbers, in their order; floats as short as they read back.

    Parameters
    ----------
    value : dict
    """
    options = {"sort_keys": False, "allow_unicode": True, "width": WIDTH, "default_flow_style": None}
    return yaml.dump(value, Dumper=_Dumper, **options)
