-- Version 4. The newest word of a monitor has what raised its flag, which what is the matter now does not tell, and the bearing that
-- it suspects, also where it has judged nothing since it started.
DROP VIEW newest;
CREATE VIEW newest AS
SELECT
    s.id AS source, s.plant, s.bus, s.node, h.time_us AS heard_us, h.state, h.reason,
    c.cause,
    (SELECT time_us FROM state
        WHERE source = s.id AND (epoch, sequence) > (coalesce(o.epoch, -1), coalesce(o.sequence, -1))
        ORDER BY epoch, sequence LIMIT 1) AS since_us,
    r.time_us AS result_us, r.flagged, coalesce(r.suspect, c.suspect) AS suspect, r.residual_um, r.ratio
FROM source s
LEFT JOIN heartbeat h ON h.source = s.id AND (h.epoch, h.sequence) = (
    SELECT epoch, sequence FROM heartbeat WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1)
LEFT JOIN state o ON o.source = s.id AND (o.epoch, o.sequence) = (
    SELECT epoch, sequence FROM state WHERE source = s.id AND state <> h.state ORDER BY epoch DESC, sequence DESC LIMIT 1)
LEFT JOIN state c ON c.source = s.id AND (c.epoch, c.sequence) = (
    SELECT epoch, sequence FROM state WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1)
LEFT JOIN result r ON r.source = s.id AND (r.epoch, r.sequence) = (
    SELECT epoch, sequence FROM result WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1);
