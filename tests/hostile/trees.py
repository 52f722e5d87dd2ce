"""Trees, scripts and rules that no mission may suffer from, drawn from a seed."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Final
from xml.sax.saxutils import quoteattr

from tests.behavior_tree.random_trees import TreeMaker

ROOT: Final = '<root BTCPP_format="4" main_tree_to_execute="Main">'
LEAF: Final = "<AlwaysSuccess/>"
MUCH: Final = (10, 30, 300, 300, 3_000, 30_000)
"""How often something is repeated: from harmless to more than an attribute or a document may have."""


def document(body: str, others: str = "", root: str = ROOT) -> str:
    """Return a document whose main tree has one node, and other elements."""
    return f'{root}<BehaviorTree ID="Main">\n{body}\n</BehaviorTree>{others}</root>'


def deep(random: Random) -> str:
    """Nest a node in decorators, or open elements that nobody closes."""
    levels = random.choice((50, 250, 256, 300, 3_000))
    tag = random.choice(("Inverter", "Sequence", "ReactiveFallback", "Delay delay_msec='1'", "x"))
    opened = f"<{tag}>" * levels
    return document(opened + LEAF + f"</{tag.split()[0]}>" * levels) if random.random() < 0.8 else ROOT + opened


def nested_trees(random: Random) -> str:
    """Nest sub-trees: hundreds, too many, in a circle, or doubling at each level."""
    count = random.choice((5, 331, 400, 1_500, 2_500))
    uses = random.choice((1, 1, 2, 3))
    last = random.choice((LEAF, f'<SubTree ID="T{random.randrange(count)}"/>', '<SubTree ID="Nowhere"/>'))
    name = random.choice(("", ' name="same"', ' _autoremap="true"', ' _autoremap="perhaps"', ' a="{a}" b="{@b}"'))
    bodies = [f'<SubTree ID="T{n + 1}"{name}/>' for n in range(count)]
    trees = [f"<Sequence>{body * uses}</Sequence>" if uses > 1 else body for body in bodies]
    others = "".join(f'<BehaviorTree ID="T{n}">{body}</BehaviorTree>' for n, body in enumerate([*trees, last]))
    return document('<SubTree ID="T0"/>', others)


def used_often(random: Random) -> str:
    """Use a sub-tree that is costly to make many times."""
    costly = random.choice((_script(random), _rules(random), "<Inverter>" * 200 + LEAF + "</Inverter>" * 200))
    uses = '<SubTree ID="S"/>' * random.choice((2, 20, 40, 400, 4_000))
    return document(f"<Sequence>{uses}</Sequence>", f'<BehaviorTree ID="S">{costly}</BehaviorTree>')


def many(random: Random) -> str:
    """Give one node many children or attributes."""
    count = random.choice(MUCH)
    if random.random() < 0.3:
        return document("<Say text='x' " + " ".join(f'a{n}="{n}"' for n in range(count)) + "/>")
    leaf = random.choice((LEAF, "<Sleep msec='1'/>", "<Script code='a := 1'/>", "<A/>", "<!-- x -->"))
    return document(f"<Sequence>{leaf * count}</Sequence>")


def entities(random: Random) -> str:
    """Declare entities: bombs, files, or parameters."""
    levels = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 12))
    declared = random.choice(
        (
            f'<!ENTITY e0 "x">{levels}',
            '<!ENTITY e11 SYSTEM "file:///etc/passwd">',
            '<!ENTITY % p SYSTEM "http://127.0.0.1:1/x"> %p;',
            '<!ENTITY e11 "&e11;">',
            f'<!ENTITY e11 "{"x" * 30_000}">',
        )
    )
    return f"<!DOCTYPE root [{declared}]>" + document('<Say text="&e11;"/>')


def encodings(random: Random) -> str:
    """Declare another encoding than the text has, or have characters that XML may not have."""
    declared = random.choice(("utf-16", "latin-1", "utf-7", "ucs-4", "nonsense", "rot13", "x" * 300, "UTF-8"))
    odd = random.choice(("\0", "\ud800", "\x1b", "\ufffe", "é", "\U0001f916", "&#0;", "&#xD800;", "&#9;", "\u202e"))
    place = random.choice((f'<Say text="a{odd}b"/>', f'<Say{odd} text="a"/>', f"{odd}{LEAF}", f"<{odd}/>"))
    return f'<?xml version="1.0" encoding="{declared}"?>{document(place)}'


def damaged(random: Random) -> str:
    """Damage a random tree."""
    text = TreeMaker(random, everything=True).document(random.randrange(1, 5))
    for _ in range(random.randrange(1, 6)):
        begin = random.randrange(len(text))
        odd = random.choice(("", '"', "<", "</", "&", "{", "\0", "<!--", "-->", "]]>", "é", "<root>", " ", ";"))
        text = text[:begin] + odd + text[begin + random.randrange(20) :]
    return text


def random_tree(random: Random) -> str:
    """Make a random tree of nodes that know nothing of this robot."""
    return TreeMaker(random, everything=True).document(random.randrange(1, 6))


def unmendable(random: Random) -> str:
    """Repeat what a lenient reader might try to mend."""
    what = random.choice(
        ("<a b='", "<!--", "<", '<a b="1"', "&", "--", "<!-- - -->", "<!---- >", "]]>", "<?x ", "<![CDATA[")
    )
    return random.choice(("", ROOT)) + what * random.choice(MUCH)


def identities(random: Random) -> str:
    """Use an ID twice, none, that of a node type, or models that contradict."""
    ids = random.choice((("A", "A"), ("", ""), ("Sequence", "B"), ("Main", "B"), ("a/b", "*"), ("x" * 9_000, "root")))
    others = "".join(f'<BehaviorTree ID="{one}">{LEAF}</BehaviorTree>' for one in ids)
    port = random.choice(('name="a"', 'name="_a"', 'name="ID"', "", 'name="a" default="infinity()" type="double"'))
    kind = random.choice(("SubTree", "Action", "Control", "Nonsense"))
    model = f'<TreeNodesModel><{kind} ID="{ids[0]}"><input_port {port}/></{kind}></TreeNodesModel>'
    return document(random.choice((LEAF, f'<SubTree ID="{ids[0]}"/>', "<A/>")), others + model * random.choice((1, 2)))


def wrong_ports(random: Random) -> str:
    """Give a node ports that it does not have, or values that they cannot have."""
    value = quoteattr(
        random.choice(
            (
                *("", "-5", "NaN", "inf", "1e999", "9" * 30, "9" * 9_000, "-1", "0x10", "1;2", "{", "{}", "{=}", "{@}"),
                *("{a b}", "true", "5.5", "json:{", "json:" + "[" * 5_000, "{" * 5_000, "&" * 500, " " * 9_000 + "x"),
            )
        )
    )
    node = random.choice(
        (
            *("<Sleep msec={}/>", "<Delay delay_msec={}><AlwaysSuccess/></Delay>", "<Sleep msec='1' nonsense={}/>"),
            *("<LoopInt queue={}><AlwaysSuccess/></LoopInt>", "<LoopString value={}><AlwaysSuccess/></LoopString>"),
            *("<NavigateTo x={} y='0'/>", "<WaitForTopic input={}/>", "<SetBlackboard value='1' output_key={}/>"),
            *("<Repeat num_cycles={}><AlwaysSuccess/></Repeat>", "<SubTree ID={}/>", "<Switch2 variable={}/>"),
            *("<Parallel success_count={}><AlwaysSuccess/></Parallel>", "<AlwaysSuccess name={}/>", "<Action ID={}/>"),
            *(
                "<CallService service={} request_type='regraft/Detect' reply_type='regraft/Sightings'/>",
                "<include path={}/>",
            ),
            *("<AlwaysSuccess _skipIf={}/>", "<AlwaysSuccess _skipif={}/>", "<AlwaysSuccess _onHalted={}/>"),
        )
    )
    return document(node.replace("{}", value, 1))


def _script(random: Random) -> str:
    count = random.choice(MUCH)
    code = random.choice(
        (
            *(
                "a := 'xx'; " + "a := a + a; " * 30,
                "5 && 2",
                "a:=1;;b:=2",
                "a := := 1",
                "1 +",
                "'",
                "\\",
                "x",
                "9" * count,
            ),
            *("(" * count + "1" + ")" * count, "1" + " + 1" * count, "-" * count + "1", "a := " * count + "1"),
            *(
                "1 ? " * count + "1" + " : 1" * count,
                "a < " * count + "1",
                "x" * count,
                " " * count + ")",
                "'" + "x" * count,
            ),
            *("min(" * count, "min(" + "1," * count + "1)", "1e999", "0x" + "f" * 40, "1 << 900", "a.b.c", "@" * count),
            *("while(1){}", "import os", "__class__", "~-!~-!1", "1/0", "a := 1" + ";" * count, "é := 1", "a\0b"),
        )
    )
    node = random.choice(("<Script code={}/>", "<AlwaysSuccess _skipIf={}/>", "<ScriptCondition code={}/>"))
    return node.format(quoteattr(code))


def scripts(random: Random) -> str:
    """Give a node a script that cannot be, or is costly to read."""
    return document(_script(random))


def _rules(random: Random) -> str:
    count = random.choice(MUCH)
    rules = random.choice(
        (
            *(
                "(" * count + "1" + ")" * count + " : a.b := 1",
                "max := 1" + " " * count + ")",
                "true : connect a.b" + " " * count,
            ),
            *(
                "a.b := 1, " * count,
                "a.b := " + "[" * count,
                "x > 1 : a.b := 3; " * count,
                "a" * count + ".b := 1",
                ":" * count,
            ),
            *(
                "a.b += 1 within [3, 1]",
                "shutdown a",
                "a.b := 1, a.b := 2",
                "a.b := 'x" + "\\" * count,
                "connect a.b to c, connect a.b to d",
            ),
            *(
                "not " * count + "x : a.b := 1",
                "1 +" * count + " 1 : a.b := 1",
                "a.b",
                "",
                ";" * count,
                "activate " * count,
            ),
        )
    )
    period = random.choice(("1", "banana", "-1", "1e-9", "1" + " " * count + "x", "{p}", "9" * 400))
    ports = random.choice(
        (
            f"rules={quoteattr(rules)}",
            "adaptation_strategy='ucb1' subject_location='a' adaptation_subject='b' adaptation_options="
            + quoteattr(random.choice(("", ";", "[" * count, "1;" * count, "1;x", "{o}", "json:" + "{" * count))),
        )
    )
    kind = random.choice(("AdaptOnStart", "AdaptPeriodically", "AdaptOnEnd", "AdaptNever"))
    more = f" adaptation_period={quoteattr(period)}" if kind == "AdaptPeriodically" else ""
    return f"<{kind} {ports}{more}>{LEAF}</{kind}>"


def rules(random: Random) -> str:
    """Give an adapt decorator rules, options or a period that cannot be, or are costly to read."""
    return document(_rules(random))


def includes(random: Random) -> str:
    """Include what is no tree."""
    path = random.choice(
        ("/dev/zero", "/dev/stdin", "/etc/passwd", ".", "a" * 5_000, "../" * 2_000, "\n", "~", "/proc/self/mem")
    )
    package = random.choice(("", ' ros_pkg="regraft"', ' ros_pkg="../.."'))
    return document(LEAF, f"<include path={quoteattr(path)}{package}/>" * random.choice((1, 1, 500)))


def large(random: Random) -> str:
    """Make a text or attribute huge."""
    size = random.choice((9_000, 11_000, 11_000, 40_000, 200_000, 260_000, 900_000))
    what = random.choice(("<Say text='{}'/>", "<!--{}-->", "<Say name='{}' text='x'/>", "{}" + LEAF, "<a{}/>"))
    return document(what.replace("{}", random.choice("x ;&é9") * size))


def shapes(random: Random) -> str:
    """Give nodes the wrong children."""
    body = random.choice(
        (
            *("<Inverter/>", "<Sequence/>", f"<Inverter>{LEAF * 2}</Inverter>", f"<Sleep msec='1'>{LEAF}</Sleep>", ""),
            *(f"<WhileDoElse>{LEAF * 4}</WhileDoElse>", f"<TryCatch>{LEAF}</TryCatch>", LEAF * 2, "text", "<root/>"),
            *(f"<Parallel success_count='99'>{LEAF}</Parallel>", f"<Switch2 variable='a'>{LEAF}</Switch2>"),
            *(f"<SubTree ID='Main'>{LEAF}</SubTree>", "<SubTree ID='Main'/>", "<BehaviorTree ID='x'/>", "<Action/>"),
        )
    )
    return document(
        body, root=random.choice((ROOT, "<root>", "<tree>", '<root BTCPP_format="9">', ROOT.replace("Main", "M")))
    )


KINDS: Final[tuple[Callable[[Random], str], ...]] = (
    *(deep, nested_trees, used_often, many, entities, encodings, damaged, random_tree, unmendable, identities),
    *(wrong_ports, scripts, rules, includes, large, shapes),
)


def hostile_tree(random: Random) -> tuple[str, str]:
    """Return the kind of a hostile tree, and its XML."""
    make = random.choice(KINDS)
    return make.__name__.replace("_", " "), make(random)
