-- Version 2: machines and jobs.

-- The drawing of the machine that a monitor watches, a rotor.toml.
CREATE TABLE machine (
    source {integer} PRIMARY KEY REFERENCES source (id),
    rotor TEXT NOT NULL
) {strict};

-- A command over the readings of one machine. Its id is made of everything that its answer depends on.
CREATE TABLE job (
    id TEXT PRIMARY KEY,
    command TEXT NOT NULL,
    source {integer} NOT NULL REFERENCES source (id),
    from_us {integer} NOT NULL,
    to_us {integer} NOT NULL,
    rotor TEXT NOT NULL,
    version TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('waiting', 'running', 'done', 'failed', 'aside', 'cancelled')),
    tries {integer} NOT NULL DEFAULT 0,
    worker TEXT,
    lease_us {integer},
    asked_us {integer} NOT NULL,
    begun_us {integer},
    ended_us {integer},
    -- a JSON object, or the sentence why there is none
    answer TEXT,
    -- the better rotor.toml, of improve
    model TEXT
) {strict};

CREATE INDEX job_state ON job (state, asked_us);
