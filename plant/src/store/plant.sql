-- Version 3: options of jobs, their pages, who has seen an alarm, and a name for this file among those that share a server.

ALTER TABLE job ADD COLUMN option TEXT;

CREATE TABLE file (
    name TEXT NOT NULL
) STRICT;

-- The newest page of each command over each machine, gzip.
CREATE TABLE report (
    source INTEGER NOT NULL REFERENCES source (id),
    command TEXT NOT NULL,
    job TEXT NOT NULL,
    page BLOB NOT NULL,
    PRIMARY KEY (source, command)
) STRICT, WITHOUT ROWID;

-- Who has seen that a monitor was in a state, which it came into then.
CREATE TABLE acknowledged (
    source INTEGER NOT NULL REFERENCES source (id),
    state TEXT NOT NULL,
    since_us INTEGER NOT NULL,
    who TEXT NOT NULL,
    time_us INTEGER NOT NULL,
    PRIMARY KEY (source, state, since_us)
) STRICT, WITHOUT ROWID;
