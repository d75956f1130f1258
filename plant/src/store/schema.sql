-- Version 1. Every table of items is unique by source, epoch and sequence; times are µs since 1970, UTC.
CREATE TABLE source (
    id INTEGER PRIMARY KEY,
    plant TEXT NOT NULL,
    bus TEXT NOT NULL,
    node INTEGER NOT NULL,
    UNIQUE (plant, bus, node)
) STRICT;

-- A 1x reading: µm zero to peak, volts; NULL is a probe that was lost or a gap that was not stated.
CREATE TABLE reading (
    source INTEGER NOT NULL REFERENCES source (id),
    epoch INTEGER NOT NULL,
    sequence INTEGER NOT NULL,
    time_us INTEGER NOT NULL,
    clock_doubtful INTEGER NOT NULL,
    speed_rpm REAL,
    keyphasor TEXT NOT NULL,
    probes INTEGER NOT NULL,
    p1_cos_um REAL, p1_sin_um REAL, p2_cos_um REAL, p2_sin_um REAL, p3_cos_um REAL, p3_sin_um REAL, p4_cos_um REAL, p4_sin_um REAL,
    p5_cos_um REAL, p5_sin_um REAL, p6_cos_um REAL, p6_sin_um REAL, p7_cos_um REAL, p7_sin_um REAL, p8_cos_um REAL, p8_sin_um REAL,
    p1_gap_v REAL, p2_gap_v REAL, p3_gap_v REAL, p4_gap_v REAL, p5_gap_v REAL, p6_gap_v REAL, p7_gap_v REAL, p8_gap_v REAL,
    PRIMARY KEY (source, epoch, sequence)
) STRICT, WITHOUT ROWID;

-- What a monitor made of the reading with the same source, epoch and sequence.
CREATE TABLE result (
    source INTEGER NOT NULL REFERENCES source (id),
    epoch INTEGER NOT NULL,
    sequence INTEGER NOT NULL,
    time_us INTEGER NOT NULL,
    clock_doubtful INTEGER NOT NULL,
    suspicious INTEGER NOT NULL,
    flagged INTEGER NOT NULL,
    suspect INTEGER,
    reason TEXT NOT NULL,
    streak INTEGER NOT NULL,
    redundancy INTEGER NOT NULL,
    used_mask INTEGER NOT NULL,
    planes INTEGER NOT NULL,
    u1_cos_g_mm REAL, u1_sin_g_mm REAL, u2_cos_g_mm REAL, u2_sin_g_mm REAL,
    u3_cos_g_mm REAL, u3_sin_g_mm REAL, u4_cos_g_mm REAL, u4_sin_g_mm REAL,
    static_cos_g_mm REAL, static_sin_g_mm REAL, dynamic_cos_g_mm REAL, dynamic_sin_g_mm REAL,
    residual_um REAL, ratio REAL, floor_um REAL, level_um REAL,
    PRIMARY KEY (source, epoch, sequence)
) STRICT, WITHOUT ROWID;

-- What a monitor said of itself, when it changed.
CREATE TABLE state (
    source INTEGER NOT NULL REFERENCES source (id),
    epoch INTEGER NOT NULL,
    sequence INTEGER NOT NULL,
    time_us INTEGER NOT NULL,
    clock_doubtful INTEGER NOT NULL,
    state TEXT NOT NULL,
    reason TEXT NOT NULL,
    missing_mask INTEGER NOT NULL,
    cause TEXT NOT NULL,
    suspect INTEGER,
    age_s REAL,
    PRIMARY KEY (source, epoch, sequence)
) STRICT, WITHOUT ROWID;

CREATE TABLE heartbeat (
    source INTEGER NOT NULL REFERENCES source (id),
    epoch INTEGER NOT NULL,
    sequence INTEGER NOT NULL,
    time_us INTEGER NOT NULL,
    clock_doubtful INTEGER NOT NULL,
    protocol INTEGER NOT NULL,
    state TEXT NOT NULL,
    reason TEXT NOT NULL,
    readings INTEGER NOT NULL,
    PRIMARY KEY (source, epoch, sequence)
) STRICT, WITHOUT ROWID;

-- For notebooks and Grafana.

-- One row a monitor: its last word.
CREATE VIEW newest AS
SELECT
    s.plant, s.bus, s.node, h.time_us AS heard_us, h.state, h.reason,
    r.time_us AS result_us, r.flagged, r.suspect, r.residual_um, r.ratio
FROM source s
LEFT JOIN heartbeat h ON h.source = s.id AND (h.epoch, h.sequence) = (
    SELECT epoch, sequence FROM heartbeat WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1)
LEFT JOIN result r ON r.source = s.id AND (r.epoch, r.sequence) = (
    SELECT epoch, sequence FROM result WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1);

-- Unbalance and residual over time; components as in `result`.
CREATE VIEW trend AS
SELECT
    s.plant, s.bus, s.node, r.time_us, r.residual_um, r.ratio, r.flagged,
    r.u1_cos_g_mm, r.u1_sin_g_mm, r.u2_cos_g_mm, r.u2_sin_g_mm
FROM result r JOIN source s ON s.id = r.source;

-- When a flag rose or fell.
CREATE VIEW flag AS
SELECT plant, bus, node, time_us, flagged, suspect, reason FROM (
    SELECT
        s.plant, s.bus, s.node, r.time_us, r.flagged, r.suspect, r.reason,
        coalesce(lag(r.flagged) OVER (PARTITION BY r.source ORDER BY r.epoch, r.sequence), 0) AS before
    FROM result r JOIN source s ON s.id = r.source) AS told
WHERE flagged <> before;

-- How much of each hour is there.
CREATE VIEW coverage AS
SELECT
    s.plant, s.bus, s.node, r.time_us / 3600000000 * 3600000000 AS hour_us, count(*) AS readings,
    count(DISTINCT r.time_us / 60000000) AS minutes
FROM reading r JOIN source s ON s.id = r.source
GROUP BY s.id, hour_us;
