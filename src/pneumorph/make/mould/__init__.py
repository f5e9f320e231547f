"""Split moulds with cores: where ports and partings are, whether pieces come off, the pieces themselves, their proof.

The body is cast upright with its base down. `plan` decides, from samples of the surfaces, where the stems are that hold
the cores and become ports, and into how many pieces the outer mould is split; `pieces` builds the solids; `proof`
checks the files; `sheet` and `bill` tell a person how to make the part.
"""
