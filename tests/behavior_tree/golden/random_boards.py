"""Random documents about blackboards, scripts and loading errors, for comparing with BehaviorTree.CPP.

`TreeMaker` has trees of all shapes over few values; the trees here are small, and their values, types and faults odd.
Left out is what differs on purpose (docs/behaviour-trees.md): numbers with a unit, blanks in braces, literals of no
member of an enumeration, and others.
"""

from random import Random
from typing import TypeVar
from xml.sax.saxutils import quoteattr

from tests.behavior_tree.random_trees import TreeMaker

T = TypeVar("T")

KINDS = ("int", "real", "bool", "text", "ints", "reals", "texts", "any")
LEAVES = {
    "int": "PassInt", "real": "PassReal", "bool": "PassBool", "text": "PassText", "ints": "PassInts",
    "reals": "PassReals", "texts": "PassTexts", "any": "PassAny",
}  # fmt: skip
LITERALS: dict[str, tuple[str, ...]] = {
    "int": ("0", "1", "-7", "42", "2147483647", "007", "x", ""),
    "real": ("0", "0.5", "-2.25", "1e3", ".5", "3.", "inf", "x", "", "1e400"),
    "bool": ("0", "1", "true", "False", "TRUE", "tRUE", "yes", "2", ""),
    "text": ("", "word", "5", "0.5", "true", "a;b", "é ü", "日本", "{", "a{b}", "'q'", '"', "json:[1]", "LOW", "{}"),
    "ints": ("", "1", "1;2;3", "x;1", "json:[1,2]", "json:[]", "json:{}", "json:[1,", 'json:["1"]', ";", "1;"),
    "reals": ("", "1", "1;0.5", "json:[1, 2.5]", "json:[]", "json:nothing", "x"),
    "texts": ("", "a", "a;b", "a;;b", 'json:["a", "b;c"]', "json:[]", "json:[1]", 'json:["a", 1]', "é;日"),
    "any": ("", "5", "0.5", "word", "true"),
}
KEYS = ("a", "b", "c", "d", "e")
OUTER_KEYS = (*KEYS, "@a", "@e")
TEXTS = ("", "x", "é", "日本", "5", "-5", "5.5", "true", "LOW", 'a"b', "a\\nb", "\\", "a;b", "word", "Z", "a")
INTS = ("0", "1", "2", "7", "42", "2147483648", "9007199254740991", "4294967296", "0x1F", "0xff", "00", "010")
REALS = ("0.5", "0.25", "1e3", "1.5e-7", "2.5E+2", "0.0", "1.0", "1e300", "1e-300", "0.1", "100.0")
NAMES = ("a", "b", "l", "r", "u", "e", "_p", "@a", "LOW", "BIG", "NONE", "true", "false")
BINARY = ("+", "-", "*", "/", "..", "==", "!=", "<", ">", "<=", ">=", "&&", "||", "&", "|", "^")
START = "a := 3; b := 0; l := 'x'; r := 0.5; _p := 1"
TARGETS = ("x", "y", "a", "b", "l", "r", "e", "_p", "@a")
ASSIGNMENTS = (":=", ":=", ":=", "=", "+=", "-=", "*=", "/=")
BAD_SCRIPTS = (
    " ;", ";", "1 +", "(1", "1)", "'open", "a b", "3foo", "5.", ".5", "0x", "1e", "a := ", ":= 1", "a ? 1", "a ? 1 : ",
    "a == == b", "@", "@@a", "a.b", "#", "a $ b", "a % 2", "a = = 1", "'1'..2", "1.5..'x'", "0x1F..'x'",
    "'a'..'b'", "a;;b", ";a", "a;",
    "!", "--1", "!!1", "~~1", "a := b := 1", "(a) := 1", "a, b",
)  # fmt: skip
BAD_NAMES = ("a b", "Root", "a/b", "a.b", "é", "a:b", "x*", "?", "_x", "9", "-", "a'b", "a&b", "a<b")

INSIDE = (
    "<Unknown/>",
    "<Script code=BAD_SCRIPT/>",
    "<Script/>",
    "<Inverter/>",
    "<Inverter><AlwaysSuccess/><AlwaysSuccess/></Inverter>",
    "<AlwaysSuccess><AlwaysSuccess/></AlwaysSuccess>",
    "<TryCatch><AlwaysSuccess/></TryCatch>",
    "<Fallback/>",
    '<SubTree ID="Nowhere"/>',
    "<SubTree/>",
    '<SubTree ID="M"/>',
    '<SubTree ID="Sequence"/>',
    '<SubTree ID="T"><AlwaysSuccess/></SubTree>',
    "<T/>",
    '<Action ID="AlwaysSuccess"/>',
    "<Action/>",
    '<Action ID="Unknown"/>',
    '<Condition ID="Inverter"/>',
    '<Decorator ID="Inverter"><AlwaysSuccess/></Decorator>',
    '<SubTree ID="T" name="s"/><SubTree ID="T" name="s"/>',
    '<PassInt name="p" in="x"/>',
    '<PassInt name="p"/>',
    '<PassInt in="{a}"/><PassBool in="{a}"/>',
    '<PassAny in="{a}"/><PassBool out="{a}"/><PassInt out="{a}"/>',
    '<Repeat num_cycles="x"><AlwaysSuccess/></Repeat>',
    "<Repeat><AlwaysSuccess/></Repeat>",
    '<Precondition if="true"><AlwaysSuccess/></Precondition>',
    "<Precondition if=BAD_SCRIPT><AlwaysSuccess/></Precondition>",
    '<Precondition if="true" else="IDLE"><AlwaysSuccess/></Precondition>',
    "<ReactiveSequence><AsyncSequence><AlwaysSuccess/></AsyncSequence><AsyncSequence><AlwaysSuccess/></AsyncSequence></ReactiveSequence>",
)
"""Elements that are put at the start of a Sequence."""
FAULTS = (
    *(("<Sequence>", f"<Sequence>{element}") for element in INSIDE),
    ("<Sequence>", "<Sequences>"),
    ("</Sequence>", "</Sequences>"),
    ("<Sequence>", "<Sequence/>"),
    ("<Sequence>", '<Sequence ID="x">'),
    ("<Sequence>", '<Sequence odd="1">'),
    ("<Sequence>", '<Sequence _odd="1">'),
    ("<Sequence>", "<Sequence name=BAD_NAME>"),
    (' in="', ' im="'),
    ("<Sequence>", "<Sequence _skipIf=BAD_SCRIPT>"),
    ("<Sequence>", "<Sequence _onFailure=BAD_SCRIPT>"),
    ("<Sequence>", "<Sequence _while=BAD_SCRIPT>"),
    ('ID="M"', 'ID="T"'),
    ('ID="T"', 'ID="Sequence"'),
    ('ID="T"', ""),
    (' main_tree_to_execute="M"', ""),
    ('execute="M"', 'execute="Q"'),
    ('"4"', '"3"'),
    (' BTCPP_format="4"', ""),
    ("<root", "<tree"),
    ("</root>", ""),
    ("</BehaviorTree>", "<AlwaysSuccess/></BehaviorTree>"),
    ("</root>", "<TreeNodesModel/><TreeNodesModel/></root>"),
    ("</root>", "<Other/></root>"),
    ("</root>", '<BehaviorTree ID="Z"/></root>'),
    ("</root>", "<BehaviorTree><AlwaysSuccess/></BehaviorTree></root>"),
    ("</root>", '<TreeNodesModel><SubTree><input_port name="a"/></SubTree></TreeNodesModel></root>'),
    ("</root>", '<TreeNodesModel><SubTree ID="T"><input_port/></SubTree></TreeNodesModel></root>'),
    ("</root>", '<TreeNodesModel><SubTree ID="T"><input_port name=BAD_NAME/></SubTree></TreeNodesModel></root>'),
    ("</root>", '<include path="missing.xml"/></root>'),
    ("</root>", "<include/></root>"),
)
"""The text that a fault replaces, and with which; it takes one of `BAD_SCRIPTS` and `BAD_NAMES`."""


class BoardMaker:
    """Makes documents of one subject; each is small, for a mistake ends a tree."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._leaves = 0
        self._usual: dict[str, str] = {}

    def document(self) -> str:
        """Return a document of any subject."""
        subject = self._random.randrange(10)
        if subject < 4:
            return self.typing()
        return self.scripts() if subject < 7 else self.faults()

    def typing(self) -> str:
        """Return a document whose leaves and scripts use few entries with many types, through two sub-trees."""
        self._leaves = 0
        self._usual = {key: self._one(KINDS) for key in KEYS}  # Else few trees would load.
        trees = [
            f'<BehaviorTree ID="{name}"><Sequence>{"".join(self._user(below) for _ in range(self._number(1, most)))}'
            "</Sequence></BehaviorTree>"
            for name, below, most in (("M", "T", 6), ("T", "U", 4), ("U", "", 3))
        ]
        return f'<root BTCPP_format="4" main_tree_to_execute="M">{"".join(trees)}{self._models()}</root>'

    def scripts(self) -> str:
        """Return a document with a few statements of odd operands, each on top of what the ones before it left."""
        statements = [self._statement() for _ in range(self._number(1, 4))]
        if self._is_one_in(8):
            statements[-1] = self._one(BAD_SCRIPTS)
        inner = "".join(f"<Script{self._attributes({'code': text})}/>" for text in statements)
        if self._is_one_in(4):
            inner += f"<ScriptCondition{self._attributes({'code': self._expression(2)})}/>"
        if self._is_one_in(4):
            key = self._one(("_skipIf", "_failureIf", "_successIf", "_while", "_post", "_onSuccess"))
            inner += f"<AlwaysSuccess{self._attributes({key: self._expression(2)})}/>"
        declared = '<PassText name="p" in="{e}"/>' if self._is_one_in(3) else ""
        body = (
            f'<Script code="{START}"/><ForceSuccess><Sequence>{declared}</Sequence></ForceSuccess>'
            if declared
            else (f'<Script code="{START}"/>')
        )
        return (
            '<root BTCPP_format="4" main_tree_to_execute="M"><BehaviorTree ID="M">'
            f"<Sequence>{body}{inner}</Sequence></BehaviorTree></root>"
        )

    def faults(self) -> str:
        """Return a document that has one or two faults, or what looks like one."""
        text = TreeMaker(self._random).document(2) if self._is_one_in(3) else self.typing()
        for _ in range(self._number(1, 2)):
            text = self._with_fault(text)
        return text

    def _user(self, below: str) -> str:
        choice = self._random.randrange(12)
        if choice < 6:
            key = self._one(KEYS)
            kind = self._one((*[self._usual[key]] * 5, "any", self._one(KINDS)))
            at = self._one(("", "", "", "@"))
            literal = self._literal(kind)
            ports = self._one((
                {"in": literal, "out": f"{{{at}{key}}}"},
                {"in": f"{{{at}{key}}}"},
                {"in": f"{{{key}}}", "out": f"{{{self._one(OUTER_KEYS)}}}"},
                {"in": literal, "out": "{=}"},
                {"in": self._one(("{=}", "{}", f"{{{key}}}")), "out": f"{{{key}}}"},
            ))  # fmt: skip
            return self._forgiven(self._leaf(LEAVES[kind], ports))
        if choice < 8:
            name, operator = self._one(OUTER_KEYS), self._one((":=", ":=", "=", "+="))
            value = self._one(("1", "7", "0.5", "'5'", "'word'", "'0.5'", "'true'", *KEYS))
            return f"<Script{self._attributes({'code': f'{name} {operator} {value}'})}/>"
        if choice == 8:
            ports = {"value": self._one(("5", "0.5", "word", "true", "{a}", "{b}", "{e}", "{@a}"))}
            return self._element("SetBlackboard", {**ports, "output_key": self._one((*KEYS, "@b"))})
        if choice == 9:
            return self._element("UnsetBlackboard", {"key": self._one(KEYS)})
        if choice == 10:
            leaf, values = self._one((
                ("PassFault", ("LOW", "BIG", "1", "100", "{a}", "{b}")), ("PassStatus", ("SUCCESS", "RUNNING", "{c}")),
            ))  # fmt: skip
            return self._forgiven(self._leaf(leaf, {"in": self._one(values)}))
        return self._subtree(below) if below else self._forgiven(self._leaf("PassAny", {"in": "{a}", "out": "{b}"}))

    def _subtree(self, tree: str) -> str:
        values = ("{a}", "{b}", "{c}", "{=}", " {d} ", "word", "true", "")
        ports = {key: self._one(values) for key in KEYS if self._is_one_in(3)}
        # A number is of one type there; here ports of any type read it.
        ports |= {key: self._number_of(kind) for key, kind in self._usual.items() if self._is_one_in(6)}
        if self._is_one_in(2):
            ports["_autoremap"] = self._one(("true", "false", "1", "0", "True"))
        return self._element("SubTree", {"ID": tree, **ports})

    def _number_of(self, kind: str) -> str:
        return self._one({"int": ("5", "-3", "0"), "real": ("0.5", "1e3", "-2.25")}.get(kind, ("word", "a;b", "é")))

    def _models(self) -> str:
        if not self._is_one_in(4):
            return ""
        port = self._one(("input_port", "output_port", "inout_port"))
        default = self._one(("", ' default="{a}"', ' default="5"', ' default="word"'))
        model = f'<SubTree ID="T"><{port} name="{self._one(KEYS)}"{default}/></SubTree>'
        return f"<TreeNodesModel>{model}</TreeNodesModel>"

    def _forgiven(self, leaf: str) -> str:
        return f"<ForceSuccess>{leaf}</ForceSuccess>" if self._is_one_in(2) else leaf

    def _leaf(self, name: str, ports: dict[str, str]) -> str:
        self._leaves += 1
        return self._element(name, {"name": f"n{self._leaves}", **ports})

    def _literal(self, kind: str) -> str:
        choices = LITERALS[self._one((*[kind] * 9, self._one(KINDS)))]
        return self._one(choices[:4]) if self._is_one_in(2) else self._one(choices)

    def _statement(self) -> str:
        if self._is_one_in(6):
            return self._expression(2)
        return f"{self._one(TARGETS)} {self._one(ASSIGNMENTS)} {self._expression(self._number(0, 3))}"

    def _expression(self, depth: int) -> str:
        choice = self._random.randrange(10)
        if depth <= 0 or choice < 2:
            return self._operand()
        if choice < 7:
            sides = (self._expression(depth - 1), self._expression(depth - 1))
            return f"{sides[0]}{self._one((' ', ' ', ''))}{self._one(BINARY)} {sides[1]}"
        if choice == 7:
            return f"{self._one(('-', '!', '~'))}{self._expression(depth - 1)}"
        if choice == 8:
            return f"({self._expression(depth - 1)})"
        return " ".join((self._expression(1), "?", self._expression(depth - 1), ":", self._expression(depth - 1)))

    def _operand(self) -> str:
        choice = self._random.randrange(8)
        if choice < 2:
            return self._one(INTS)
        if choice == 2:
            return self._one(REALS)
        return f"'{self._one(TEXTS)}'" if choice < 5 else self._one(NAMES)

    def _with_fault(self, text: str) -> str:
        """Return a document with something in it replaced; nothing happens where it is not found."""
        old, new = self._one(FAULTS)
        new = new.replace("BAD_SCRIPT", quoteattr(self._one(BAD_SCRIPTS)))
        return text.replace(old, new.replace("BAD_NAME", quoteattr(self._one(BAD_NAMES))), 1)

    def _element(self, name: str, attributes: dict[str, str]) -> str:
        return f"<{name}{self._attributes(attributes)}/>"

    def _attributes(self, attributes: dict[str, str]) -> str:
        return "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())

    def _number(self, least: int, most: int) -> int:
        return self._random.randint(least, most)

    def _one(self, choices: tuple[T, ...]) -> T:
        return choices[self._random.randrange(len(choices))]

    def _is_one_in(self, number: int) -> bool:
        return self._random.randrange(number) == 0
