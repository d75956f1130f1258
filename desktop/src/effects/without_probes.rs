//! A machine without probes that cannot be trusted, and without what its file states of them.

use super::entry::resolve;
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::machine::place::Place;

impl Rotor {
    /// The machine without these probes, and without the effects that are theirs alone.
    ///
    /// # Errors
    /// If a name is no probe's, or the machine cannot be computed with the probes that are left.
    pub fn without_probes(&self, names: &[String]) -> Result<Self, Error> {
        let mut whole = self.whole();
        for name in names {
            let Some(place) = whole.probe.iter().position(|probe| probe.name == *name) else {
                let known: Vec<String> = whole.probe.iter().map(|p| format!("\"{}\"", p.name)).collect();
                let what = format!("there is no probe \"{name}\", expected one of {}", known.join(", "));
                return Err(Error::rotor(&self.name, "[[probe]]", what));
            };
            whole.probe[place].used = false;
        }
        let is_of_unused = |at: &Place| matches!(at, Place::Probe(place) if !whole.probe[*place].used);
        let kept = whole.effect.iter().filter(|entry| {
            !resolve(&whole, &entry.kind, entry.at.as_deref()).is_ok_and(|(_, at)| is_of_unused(&at))
        });
        let effect = kept.cloned().collect();
        if !names.is_empty() {
            whole.schema = whole.schema.max(2);
        }
        let left = Self { effect, ..whole }.set_aside();
        left.validate()?;
        Ok(left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::{EffectEntry, ParameterValue, UnusedProbe};
    use crate::rotor_file;
    use crate::testing::sample_rotor;

    fn runout(vectors: &[[f64; 2]]) -> EffectEntry {
        let parameters = [("v".to_string(), ParameterValue::Phasors(vectors.to_vec()))].into();
        EffectEntry { kind: "runout".into(), at: None, parameters }
    }

    fn names(rotor: &Rotor) -> Vec<&str> {
        rotor.probe.iter().map(|probe| probe.name.as_str()).collect()
    }

    #[test]
    fn unused_probe_is_set_aside_and_written_in_its_place() {
        let mut rotor = sample_rotor();
        rotor.effect = vec![runout(&[[1e-6, 0.0], [2e-6, 0.0], [3e-6, 0.0], [4e-6, 0.0]])];
        let all: Vec<String> = names(&rotor).into_iter().map(String::from).collect();
        let left = rotor.without_probes(&[all[1].clone()]).unwrap();
        assert_eq!(names(&left), [&all[0], &all[2], &all[3]]);
        assert_eq!(left.unused.iter().map(UnusedProbe::name).collect::<Vec<_>>(), [&all[1]]);
        assert_eq!(left.effect, [runout(&[[1e-6, 0.0], [3e-6, 0.0], [4e-6, 0.0]])]);
        assert_eq!(left.identity(), rotor.identity(), "it is the same machine");

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rotor.toml");
        rotor_file::write(&path, &left).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.matches("used = false").count(), 1, "{text}");
        assert_eq!(rotor_file::read(&path).unwrap(), left);
        let whole = left.whole();
        assert_eq!(names(&whole), all);
        assert_eq!(whole.probe.iter().map(|p| p.used).collect::<Vec<_>>(), [true, false, true, true]);
        assert_eq!(whole.effect, [runout(&[[1e-6, 0.0], [0.0; 2], [3e-6, 0.0], [4e-6, 0.0]])]);
        let fewer = left.without_probes(&[all[3].clone()]).unwrap();
        assert_eq!((names(&fewer), fewer.unused.len()), (vec![all[0].as_str(), all[2].as_str()], 2));
    }

    #[test]
    fn unknown_or_last_probe_and_effects_of_unused_are_refused() {
        let rotor = sample_rotor();
        let refused = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
            rotor.without_probes(&names).unwrap_err().to_string()
        };
        let unknown = refused(&["nowhere"]);
        assert!(unknown.contains("there is no probe \"nowhere\", expected one of"), "{unknown}");
        assert!(refused(&names(&rotor)).contains("at least one probe"));
        let text = toml::to_string(&{
            let mut whole = Rotor { schema: 2, ..rotor.clone() };
            let at = Some(whole.probe[1].name.clone());
            whole.effect = vec![EffectEntry { kind: "probe_reversed".into(), at, parameters: [].into() }];
            whole
        });
        let text = text.unwrap();
        assert!(rotor_file::parse("r.toml", &text).is_ok());
        let name = format!("name = \"{}\"\n", rotor.probe[1].name);
        let unused = text.replacen(&name, &format!("{name}used = false\n"), 1);
        let refused = rotor_file::parse("r.toml", &unused).unwrap_err().to_string();
        assert!(refused.contains("probe_reversed cannot sit at"), "{refused}");
        let of_schema_1 = unused.replace("schema = 2", "schema = 1");
        assert!(rotor_file::parse("r.toml", &of_schema_1).unwrap_err().to_string().contains("schema"));
    }

    #[test]
    fn effects_at_probe_that_is_left_out_go_with_it() {
        let mut rotor = sample_rotor();
        let at = |place: usize| EffectEntry {
            kind: "probe_reversed".into(),
            at: Some(rotor.probe[place].name.clone()),
            parameters: [].into(),
        };
        let (out, kept) = (at(1), at(2));
        rotor.effect = vec![out, kept.clone()];
        let left = rotor.without_probes(&[rotor.probe[1].name.clone()]).unwrap();
        assert_eq!(left.effect, [kept]);
    }
}
