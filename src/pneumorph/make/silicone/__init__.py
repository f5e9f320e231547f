"""Silicone moulds (compound moulding): hard masters, silicone negatives cast around them, parts of rubber to glue.

The body is divided by planes along its axis that open every chamber. `plan` chooses the planes; `pieces` builds the
masters, boxes, negatives and parts; `proof` checks the files; `sheet` and `bill` tell a person how to make the body.
The way in one casting with cores is `pneumorph.make.mould`, from which this one takes ports, keys and checks.
"""
