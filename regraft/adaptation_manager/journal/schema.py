"""The journal's tables. Messages are kept as on the bus; the columns to search by are next to them.

``revision`` is set on lines that gave one; ``following`` is what changes in the architecture. Columns written once and
what changes later have seals of their own. A row that is not as it was written is moved to ``damaged``.
"""

VERSION = 4

TABLES = """
CREATE TABLE term (term INTEGER NOT NULL, seal BLOB NOT NULL);
CREATE TABLE runs (
    run TEXT PRIMARY KEY,
    architecture BLOB NOT NULL,
    seal BLOB NOT NULL
);
CREATE TABLE adaptations (
    run TEXT NOT NULL,
    number INTEGER NOT NULL,
    key TEXT NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    outcome TEXT NOT NULL,
    revision INTEGER,
    report BLOB NOT NULL,
    seal BLOB NOT NULL,
    following BLOB NOT NULL,
    following_seal BLOB NOT NULL,
    PRIMARY KEY (run, number)
) WITHOUT ROWID;
CREATE TABLE steps (
    run TEXT NOT NULL,
    number INTEGER NOT NULL,
    step INTEGER NOT NULL,
    state TEXT NOT NULL,
    seal BLOB NOT NULL,
    plan BLOB NOT NULL,
    plan_seal BLOB NOT NULL,
    PRIMARY KEY (run, number, step)
) WITHOUT ROWID;
CREATE TABLE damaged (
    origin TEXT NOT NULL,
    run TEXT,
    number INTEGER,
    fields TEXT NOT NULL
);
"""

LATER_TABLES = """
CREATE TABLE IF NOT EXISTS faults (
    run TEXT NOT NULL,
    stamp REAL NOT NULL,
    fault BLOB NOT NULL,
    seal BLOB NOT NULL,
    UNIQUE (run, fault)
);
CREATE TABLE IF NOT EXISTS architectures (
    run TEXT NOT NULL,
    revision INTEGER NOT NULL,
    architecture BLOB NOT NULL,
    seal BLOB NOT NULL,
    PRIMARY KEY (run, revision)
) WITHOUT ROWID;
DROP INDEX IF EXISTS adaptations_open;
"""
"""Also done to a journal that had begun without it. ``architectures`` keeps some of the revisions whole.

The index was written with each adaptation, and no question could use it.
"""

CREATE_INDEXES = (
    "CREATE INDEX adaptations_by_key ON adaptations (run, key) WHERE key != ''",
    "CREATE UNIQUE INDEX adaptations_by_revision ON adaptations (run, revision) WHERE revision IS NOT NULL",
)
DROP_INDEXES = (
    "DROP INDEX IF EXISTS adaptations_by_key",
    "DROP INDEX IF EXISTS adaptations_by_revision",
)
SCHEMA = TABLES + "".join(f"{statement};" for statement in CREATE_INDEXES)

RUN = "run, architecture"
KEPT = "run, revision, architecture"
LINE = "run, number, key, actor, reason, outcome, revision, report"
FOLLOWING = "run, number, following"
STATE = "run, number, step, state"
PLAN = "run, number, step, plan"
"""The fields that a seal is over, in its order."""
