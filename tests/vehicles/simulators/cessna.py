# SPDX-License-Identifier: MIT
"""The Cessna 172P of the installed jsbsim package, with properties that scale its coefficients.

Nothing of JSBSim is stored in the project: write() makes the modified aircraft from the package.
"""
import functools
import os

import jsbsim

NAME = "cessna"
# aerodynamic coefficient of c172p.xml: the property that it is multiplied by
FACTORS = {"CDo": "k/cdo", "CDDf": "k/cdf", "CLDf": "k/clf", "ClDa": "k/clda", "Cmde": "k/cmde",
           "Cndr": "k/cndr", "Clp": "k/clp"}
EXTRA = "k/extra"  # a drag area of its own, in square feet


def package():
    return os.path.dirname(jsbsim.__file__)


def multiplied(text, coefficient, factor):
    """The aircraft with one coefficient multiplied by the property `factor`."""
    function = text.index('<function name="aero/coefficient/%s">' % coefficient)
    at = text.index("<product>", function) + len("<product>")
    return text[:at] + "\n <property>%s</property>" % factor + text[at:]


@functools.cache
def modified():
    """The text of the modified aircraft."""
    with open(os.path.join(package(), "aircraft", "c172p", "c172p.xml")) as f:
        text = f.read()
    for coefficient, factor in FACTORS.items():
        text = multiplied(text, coefficient, factor)
    declared = ['<property value="1.0">%s</property>' % factor for factor in FACTORS.values()]
    declared.append('<property value="0.0">%s</property>' % EXTRA)
    control, drag = '<flight_control name="FCS: c172">', '<axis name="DRAG">'
    if control not in text or drag not in text:
        raise ValueError("jsbsim's c172p.xml is not the one of requirements.txt")
    text = text.replace(control, "\n".join([control] + declared))
    return text.replace(drag, drag + """
 <function name="aero/coefficient/CDextra">
  <product><property>aero/qbar-psf</property><property>%s</property></product>
 </function>""" % EXTRA)


def write(folder):
    """Writes the modified aircraft NAME below `folder`, where JSBSim looks for aircraft."""
    os.makedirs(os.path.join(folder, NAME))
    with open(os.path.join(folder, NAME, NAME + ".xml"), "w") as f:
        f.write(modified())
