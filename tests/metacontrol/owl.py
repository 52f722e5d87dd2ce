"""Writes OWL files for tests: individuals as tables, and rules."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

TOMASYS = "http://metacontrol.org/tomasys#"
MROS = "http://ros/mros#"
NAVIGATION = "http://ros/navigation_domain#"
APPLICATION = "http://ros/application#"
XSD = "http://www.w3.org/2001/XMLSchema#"
PREFIXES = {"tomasys": TOMASYS, "mros": MROS, "nav": NAVIGATION, "app": APPLICATION}
HEAD = f"""<?xml version="1.0"?>
<rdf:RDF xml:base="http://ros/application" xmlns:tomasys="{TOMASYS}" xmlns:mros="{MROS}"
  xmlns:nav="{NAVIGATION}" xmlns:app="{APPLICATION}"
  xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:rdfs="http://www.w3.org/2000/01/rdf-schema#"
  xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:swrl="http://www.w3.org/2003/11/swrl#">
"""
IMPORTS = ("http://ros/navigation_domain",)


def iri(name: str) -> str:
    """Return the IRI of a name with a prefix; one without is the application's."""
    prefix, colon, local = name.partition(":")
    return PREFIXES[prefix] + local if colon else APPLICATION + name


def individual(name: str, kind: str = "", /, **properties: object) -> str:
    """Return an individual: texts that begin with ">" are names of others, lists are several values."""
    lines = [f"<rdf:Description rdf:about={quoteattr(iri(name))}>"]
    if kind:
        lines.append(f"  <rdf:type rdf:resource={quoteattr(iri(kind))}/>")
    for key, given in properties.items():
        element = key.replace("__", ":")
        values = given if isinstance(given, list | tuple) else [given]
        lines += [f"  {_value(element, value)}" for value in values]
    return "\n".join([*lines, "</rdf:Description>", ""])


def _value(element: str, value: object) -> str:
    if isinstance(value, str) and value.startswith(">") and len(value) > 1:
        return f"<{element} rdf:resource={quoteattr(iri(value[1:]))}/>"
    kind = "boolean" if isinstance(value, bool) else "string" if isinstance(value, str) else "decimal"
    shown = str(value).lower() if isinstance(value, bool) else escape(str(value))
    return f'<{element} rdf:datatype="{XSD}{kind}">{shown}</{element}>'


def design(
    name: str,
    function: str,
    qualities: Mapping[str, float],
    requires: Iterable[str] = (),
    **properties: object,
) -> str:
    """Return a design with its estimates, and the components that require it to be left out when they fail."""
    estimates = [f">qa_{quality.rpartition(':')[2]}_{name}" for quality in qualities]
    parts = [
        individual(
            name,
            "tomasys:FunctionDesign",
            tomasys__solvesF=f">{function}",
            tomasys__hasQAestimation=estimates,
            **properties,
        )
    ]
    for (quality, value), estimate in zip(qualities.items(), estimates, strict=True):
        parts.append(
            individual(estimate[1:], "tomasys:QAvalue", tomasys__isQAtype=f">{quality}", tomasys__hasValue=value)
        )
    parts += [individual(component, mros__requiredBy=f">{name}") for component in requires]
    return "".join(parts)


def quality(name: str, direction: str, weight: float = 0.0) -> str:
    """Return a type of quality."""
    return individual(name, "tomasys:QualityAttributeType", mros__qa_direction=direction, mros__qa_weight=weight)


def rule(label: str, body: Iterable[str], head: Iterable[str], variables: str = "x y z v w") -> str:
    """Return a rule of atoms such as ``app:p ?x ?y``, ``app:d ?x "text"``, ``app:C ?x`` or ``swrlb:equal ?x 1.5``."""
    declared = "".join(f'<swrl:Variable rdf:about="#{name}"/>\n' for name in variables.split())
    parts = (
        f'<swrl:{name} rdf:parseType="Collection">\n{"".join(map(_atom, atoms))}</swrl:{name}>\n'
        for name, atoms in (("body", body), ("head", head))
    )
    return f"{declared}<swrl:Imp>\n<rdfs:label>{label}</rdfs:label>\n{''.join(parts)}</swrl:Imp>\n"


def _atom(text: str) -> str:
    name, *arguments = text.split()
    if name in {"sameAs", "differentFrom"}:
        kind = "SameIndividualAtom" if name == "sameAs" else "DifferentIndividualsAtom"
        return f"<swrl:{kind}>{''.join(map(_argument, (1, 2), arguments))}</swrl:{kind}>\n"
    if name.startswith("swrlb:"):
        items = "<rdf:rest><rdf:Description>".join(_first(each) for each in arguments)
        ends = "</rdf:Description></rdf:rest>" * (len(arguments) - 1)
        end = '<rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/>'
        builtin = f"http://www.w3.org/2003/11/swrlb#{name[6:]}"
        return (
            f'<swrl:BuiltinAtom><swrl:builtin rdf:resource="{builtin}"/><swrl:arguments><rdf:Description>'
            f"{items}{end}{ends}</rdf:Description></swrl:arguments></swrl:BuiltinAtom>\n"
        )
    predicate = quoteattr(iri(name))
    if len(arguments) == 1:
        inside = f"<swrl:classPredicate rdf:resource={predicate}/>{_argument(1, arguments[0])}"
        return f"<swrl:ClassAtom>{inside}</swrl:ClassAtom>\n"
    is_data = _is_value(arguments[1]) or name.rpartition(":")[2] in DATA or arguments[1] in DATA_VARIABLES
    kind = "DatavaluedPropertyAtom" if is_data else "IndividualPropertyAtom"
    inside = "".join(map(_argument, (1, 2), arguments))
    return f"<swrl:{kind}><swrl:propertyPredicate rdf:resource={predicate}/>{inside}</swrl:{kind}>\n"


DATA_VARIABLES = {"?v", "?w"}
DATA = {"hasValue", "v", "w", "o_status", "fg_status", "c_status", "qa_direction"}


def _is_value(text: str) -> bool:
    return text[0] in '"-0123456789' or text in {"true", "false"}


def _typed(text: str) -> tuple[str, str]:
    if text[0] == '"':
        return "string", text[1:-1]
    return ("boolean", text) if text in {"true", "false"} else ("decimal", text)


def _argument(position: int, text: str) -> str:
    return _node(f"swrl:argument{position}", text)


def _first(text: str) -> str:
    return _node("rdf:first", text)


def _node(element: str, text: str) -> str:
    if text.startswith("?"):
        return f'<{element} rdf:resource="#{text[1:]}"/>'
    if _is_value(text):
        kind, value = _typed(text)
        return f'<{element} rdf:datatype="{XSD}{kind}">{escape(value)}</{element}>'
    return f"<{element} rdf:resource={quoteattr(iri(text))}/>"


def write(
    folder: Path,
    *parts: str,
    name: str = "app.owl",
    ontology: str = "http://ros/application",
    imports: Iterable[str] = IMPORTS,
) -> Path:
    """Write a file of individuals and rules, and return its path."""
    stated = "".join(f"  <owl:imports rdf:resource={quoteattr(target)}/>\n" for target in imports)
    header = f"<owl:Ontology rdf:about={quoteattr(ontology)}>\n{stated}</owl:Ontology>\n"
    path = folder / name
    path.write_text(f"{HEAD}{header}{''.join(parts)}</rdf:RDF>\n")
    return path


SAFETY, PERFORMANCE, ENERGY = "mros:safety", "mros:performance", "mros:energy"
LASER, CAMERA, BATTERY = "nav:laser_resender", "nav:camera", "nav:battery"
NAVIGATE = "nav:to_navigate"
REALIZATIONS: Mapping[str, tuple[tuple[str, ...], float, float, float]] = {
    "normal": ((LASER, BATTERY), 0.8, 0.7, 0.5),
    "performance": ((LASER, BATTERY), 0.55, 0.9, 0.7),
    "slow": ((LASER, BATTERY), 0.7, 0.4, 0.3),
    "energy_saving": ((LASER,), 0.6, 0.3, 0.34),
    "degraded": ((CAMERA, BATTERY), 0.55, 0.2, 0.45),
    "degraded_energy_save": ((CAMERA,), 0.6, 0.1, 0.34),
}
"""The published realizations of to_navigate: components, safety, performance, energy."""


def published_designs() -> str:
    """Return the published realizations as designs."""
    return "".join(
        design(name, NAVIGATE, {SAFETY: safety, PERFORMANCE: performance, ENERGY: energy}, needs)
        for name, (needs, safety, performance, energy) in REALIZATIONS.items()
    )
