//! The diagnosis of data that bearings and planes alone use up.

use std::borrow::Cow;

use super::advice;
use super::answer::{Candidate, Diagnosis, DiagnosisVerdict};
use super::base::BaseModel;
use super::diagnosis::{FittedValues, PRIOR};
use crate::fit::hypothesis::PlacedEffect;
use crate::machine::drawing::Noise;

impl BaseModel<'_> {
    /// The answer where bearings and planes alone use all degrees of freedom of the data: anything is possible.
    pub fn undecidable(
        &self,
        why: String,
        noise: Noise,
        remarks: Vec<String>,
        FittedValues { determined, bearings, dimensions }: FittedValues,
    ) -> Diagnosis {
        let rotor = self.fitter.rotor;
        let possible = self.possible();
        let advice = advice::between_typical(self, &possible, &noise);
        let mut remarks = remarks;
        remarks.extend(advice.is_empty().then(|| advice::another_kind(self)));
        let error_before = self.relative_error(self.shown().0);
        // the prior, as the data add nothing to it
        let probability = (1.0 - PRIOR) / possible.len().max(1) as f64;
        let candidate = |a: &PlacedEffect| Candidate {
            effect: a.effect.name(),
            at: a.place.name(rotor).map(Cow::into_owned),
            probability,
            support: 0.0,
            error_after: error_before,
            chi2_per_value: self.closest().chi2_per_value(),
            parameters: Vec::new(),
            model_fits: false,
            disqualified: None,
            evidence: "nothing, these data cannot show it.".into(),
            knowledge: a.effect.knowledge(),
        };
        Diagnosis {
            verdict: DiagnosisVerdict::Undecided,
            summary: [Some(format!("{why}.")), determined.alike()]
                .into_iter()
                .flatten()
                .collect::<Vec<_>>()
                .join(" "),
            error_before,
            chi2_per_value: self.closest().chi2_per_value(),
            nothing_missing: PRIOR,
            candidates: possible.iter().map(candidate).collect(),
            indistinguishable: vec![possible.iter().map(|a| a.label(rotor)).collect()],
            saturated: true,
            too_fast: None,
            bad_probe: None,
            mistake: None,
            together: Vec::new(),
            held_out: None,
            advice,
            remarks,
            noise,
            scatter: self.drawing.scatter(),
            unknown: None,
            determined,
            bearings,
            dimensions,
            refuted: Vec::new(),
        }
    }
}
