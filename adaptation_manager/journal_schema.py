"""The journal's tables. Messages are kept as on the bus; what one searches by stands beside them."""

VERSION = 2

SCHEMA = """
CREATE TABLE reign (term INTEGER NOT NULL);
INSERT INTO reign VALUES (0);
CREATE TABLE runs (
    run TEXT PRIMARY KEY,
    architecture BLOB NOT NULL
);
CREATE TABLE adaptations (
    run TEXT NOT NULL REFERENCES runs,
    number INTEGER NOT NULL,
    key TEXT NOT NULL,
    who TEXT NOT NULL,
    reason TEXT NOT NULL,
    outcome TEXT NOT NULL,
    revision INTEGER,
    report BLOB NOT NULL,
    following BLOB NOT NULL,
    PRIMARY KEY (run, number)
) WITHOUT ROWID;
CREATE INDEX adaptations_by_key ON adaptations (run, key) WHERE key != '';
CREATE INDEX adaptations_open ON adaptations (run) WHERE outcome = 'pending';
CREATE UNIQUE INDEX adaptations_by_revision ON adaptations (run, revision) WHERE revision IS NOT NULL;
CREATE TABLE steps (
    run TEXT NOT NULL,
    number INTEGER NOT NULL,
    step INTEGER NOT NULL,
    state TEXT NOT NULL,
    plan BLOB NOT NULL,
    PRIMARY KEY (run, number, step)
) WITHOUT ROWID;
"""
"""``revision`` is set on lines that gave one; ``following`` is what changes in the architecture."""
