-- Version 3: options of jobs, their pages, who has seen an alarm, and a name for this file among those that share a server.

ALTER TABLE job ADD COLUMN option TEXT;

CREATE TABLE file (
    name TEXT NOT NULL
) {strict};

-- The newest page of each command over each machine, gzip.
CREATE TABLE report (
    source {integer} NOT NULL REFERENCES source (id),
    command TEXT NOT NULL,
    job TEXT NOT NULL,
    page {blob} NOT NULL,
    PRIMARY KEY (source, command)
) {by_key};

-- Who has seen that a monitor was in a state, which it came into then.
CREATE TABLE acknowledged (
    source {integer} NOT NULL REFERENCES source (id),
    state TEXT NOT NULL,
    since_us {integer} NOT NULL,
    who TEXT NOT NULL,
    time_us {integer} NOT NULL,
    PRIMARY KEY (source, state, since_us)
) {by_key};

-- What a page shows over a time, what a job reads, what a day's file holds.
CREATE INDEX reading_time ON reading (source, time_us);
CREATE INDEX result_time ON result (source, time_us);
CREATE INDEX state_time ON state (source, time_us);
CREATE INDEX heartbeat_time ON heartbeat (source, time_us);

-- One row a monitor: its last word, and when it came into its state, where it told: the first after the last other state.
DROP VIEW newest;
CREATE VIEW newest AS
SELECT
    s.id AS source, s.plant, s.bus, s.node, h.time_us AS heard_us, h.state, h.reason,
    (SELECT time_us FROM state
        WHERE source = s.id AND (epoch, sequence) > (coalesce(o.epoch, -1), coalesce(o.sequence, -1))
        ORDER BY epoch, sequence LIMIT 1) AS since_us,
    r.time_us AS result_us, r.flagged, r.suspect, r.residual_um, r.ratio
FROM source s
LEFT JOIN heartbeat h ON h.source = s.id AND (h.epoch, h.sequence) = (
    SELECT epoch, sequence FROM heartbeat WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1)
LEFT JOIN state o ON o.source = s.id AND (o.epoch, o.sequence) = (
    SELECT epoch, sequence FROM state WHERE source = s.id AND state <> h.state ORDER BY epoch DESC, sequence DESC LIMIT 1)
LEFT JOIN result r ON r.source = s.id AND (r.epoch, r.sequence) = (
    SELECT epoch, sequence FROM result WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1);
