-- Version 1. Every table of items is unique by source, epoch and sequence; times are µs since 1970, UTC.
CREATE TABLE source (
    id {id},
    plant TEXT NOT NULL,
    bus TEXT NOT NULL,
    node {integer} NOT NULL,
    UNIQUE (plant, bus, node)
) {strict};

-- A 1x reading: µm zero to peak, volts; NULL is a probe that was lost or a gap that was not stated.
CREATE TABLE reading (
    source {integer} NOT NULL REFERENCES source (id),
    epoch {integer} NOT NULL,
    sequence {integer} NOT NULL,
    time_us {integer} NOT NULL,
    clock_doubtful {integer} NOT NULL,
    speed_rpm {real},
    keyphasor TEXT NOT NULL,
    probes {integer} NOT NULL,
    p1_cos_um {real}, p1_sin_um {real}, p2_cos_um {real}, p2_sin_um {real}, p3_cos_um {real}, p3_sin_um {real}, p4_cos_um {real}, p4_sin_um {real},
    p5_cos_um {real}, p5_sin_um {real}, p6_cos_um {real}, p6_sin_um {real}, p7_cos_um {real}, p7_sin_um {real}, p8_cos_um {real}, p8_sin_um {real},
    p1_gap_v {real}, p2_gap_v {real}, p3_gap_v {real}, p4_gap_v {real}, p5_gap_v {real}, p6_gap_v {real}, p7_gap_v {real}, p8_gap_v {real},
    PRIMARY KEY (source, epoch, sequence)
) {by_key};

-- What a monitor made of the reading with the same source, epoch and sequence.
CREATE TABLE result (
    source {integer} NOT NULL REFERENCES source (id),
    epoch {integer} NOT NULL,
    sequence {integer} NOT NULL,
    time_us {integer} NOT NULL,
    clock_doubtful {integer} NOT NULL,
    suspicious {integer} NOT NULL,
    flagged {integer} NOT NULL,
    suspect {integer},
    reason TEXT NOT NULL,
    streak {integer} NOT NULL,
    redundancy {integer} NOT NULL,
    used_mask {integer} NOT NULL,
    planes {integer} NOT NULL,
    u1_cos_g_mm {real}, u1_sin_g_mm {real}, u2_cos_g_mm {real}, u2_sin_g_mm {real},
    u3_cos_g_mm {real}, u3_sin_g_mm {real}, u4_cos_g_mm {real}, u4_sin_g_mm {real},
    static_cos_g_mm {real}, static_sin_g_mm {real}, dynamic_cos_g_mm {real}, dynamic_sin_g_mm {real},
    residual_um {real}, ratio {real}, floor_um {real}, level_um {real},
    PRIMARY KEY (source, epoch, sequence)
) {by_key};

-- What a monitor said of itself, when it changed.
CREATE TABLE state (
    source {integer} NOT NULL REFERENCES source (id),
    epoch {integer} NOT NULL,
    sequence {integer} NOT NULL,
    time_us {integer} NOT NULL,
    clock_doubtful {integer} NOT NULL,
    state TEXT NOT NULL,
    reason TEXT NOT NULL,
    missing_mask {integer} NOT NULL,
    cause TEXT NOT NULL,
    suspect {integer},
    age_s {real},
    PRIMARY KEY (source, epoch, sequence)
) {by_key};

CREATE TABLE heartbeat (
    source {integer} NOT NULL REFERENCES source (id),
    epoch {integer} NOT NULL,
    sequence {integer} NOT NULL,
    time_us {integer} NOT NULL,
    clock_doubtful {integer} NOT NULL,
    protocol {integer} NOT NULL,
    state TEXT NOT NULL,
    reason TEXT NOT NULL,
    readings {integer} NOT NULL,
    PRIMARY KEY (source, epoch, sequence)
) {by_key};

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
