//! A recurrent network (long short-term memory) that foretells tomorrow's change from the last weeks'.
//!
//! Hidden units and dropout of 0.2 as in Sensors 2024, 24, 8123; days further ahead are forecast from its own
//! forecasts. Weights and dropout are drawn from a seed of ours, as the framework's own generator on the
//! processor cannot be seeded: the same past gives the same network.

use candle_core::{DType, Device, Tensor};
use candle_nn::rnn::{LSTM, LSTMState};
use candle_nn::{AdamW, Linear, Module, Optimizer, ParamsAdamW, RNN, VarBuilder, VarMap};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::error::{Error, ForecastError};

/// Changes that the network looks back on.
const LOOK_BACK: usize = 30;
const HIDDEN: usize = 24;
const DROPOUT: f64 = 0.2;
const EPOCHS: usize = 80;
const LEARNING_RATE: f64 = 0.01;
/// Fewest windows to learn from.
const FEWEST: usize = 20;

#[derive(Clone)]
pub struct Network {
    lstm: LSTM,
    output: Linear,
    mean: f64,
    scale: f64,
    /// Standard deviation of what was left of a day's change in training.
    pub sd: f64,
}

impl std::fmt::Debug for Network {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Network").field("hidden", &HIDDEN).field("sd", &self.sd).finish_non_exhaustive()
    }
}

fn failed(e: candle_core::Error) -> Error {
    Error::Unsuitable(format!("the network failed: {e}"))
}

impl Network {
    /// Trains on a past.
    ///
    /// # Errors
    /// If the past is too short or does not change.
    pub fn train(past: &[f64], seed: u64) -> Result<Self, Error> {
        let changes: Vec<f64> = past.windows(2).map(|w| w[1] - w[0]).collect();
        if changes.len() < LOOK_BACK + FEWEST {
            let needed = LOOK_BACK + FEWEST + 1;
            return Err(ForecastError::ShortForLstm { needed, days: past.len() }.into());
        }
        let count = changes.len() as f64;
        let mean = changes.iter().sum::<f64>() / count;
        let scale = (changes.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / count).sqrt();
        if scale <= f64::MIN_POSITIVE {
            return Err(ForecastError::ConstantSeries { purpose: "learn" }.into());
        }
        let units: Vec<f32> = changes.iter().map(|c| ((c - mean) / scale) as f32).collect();
        Self::fit(&units, seed).map_err(failed).map(|(lstm, output, left)| Self {
            lstm,
            output,
            mean,
            scale,
            sd: left * scale,
        })
    }

    fn fit(units: &[f32], seed: u64) -> Result<(LSTM, Linear, f64), candle_core::Error> {
        let device = Device::Cpu;
        let mut random = StdRng::seed_from_u64(seed);
        let weights = VarMap::new();
        let builder = VarBuilder::from_varmap(&weights, DType::F32, &device);
        let lstm = candle_nn::rnn::lstm(1, HIDDEN, Default::default(), builder.pp("lstm"))?;
        let output = candle_nn::linear(HIDDEN, 1, builder.pp("output"))?;
        // in an order that does not change from run to run
        let mut named: Vec<(String, candle_core::Var)> = {
            let data = weights.data().lock().expect("nobody else holds the weights");
            data.iter().map(|(name, var)| (name.clone(), var.clone())).collect()
        };
        named.sort_by(|a, b| a.0.cmp(&b.0));
        let bound = 1.0 / (HIDDEN as f32).sqrt();
        for (_, var) in &named {
            let drawn: Vec<f32> = (0..var.elem_count()).map(|_| random.random_range(-bound..bound)).collect();
            var.set(&Tensor::from_vec(drawn, var.shape(), &device)?)?;
        }
        let windows = units.len() - LOOK_BACK;
        let inputs: Vec<f32> = (0..windows).flat_map(|k| units[k..k + LOOK_BACK].iter().copied()).collect();
        let inputs = Tensor::from_vec(inputs, (windows, LOOK_BACK, 1), &device)?;
        let targets = Tensor::from_vec(units[LOOK_BACK..].to_vec(), (windows, 1), &device)?;
        let vars = named.into_iter().map(|(_, var)| var).collect();
        let mut adam = AdamW::new(vars, ParamsAdamW { lr: LEARNING_RATE, ..ParamsAdamW::default() })?;
        let last_hidden = || -> Result<Tensor, candle_core::Error> {
            let states = lstm.seq(&inputs)?;
            Ok(states[states.len() - 1].h().clone())
        };
        for _ in 0..EPOCHS {
            let kept = (1.0 / (1.0 - DROPOUT)) as f32;
            let mask: Vec<f32> =
                (0..windows * HIDDEN).map(|_| if random.random_bool(DROPOUT) { 0.0 } else { kept }).collect();
            let hidden = (last_hidden()? * Tensor::from_vec(mask, (windows, HIDDEN), &device)?)?;
            let loss = candle_nn::loss::mse(&output.forward(&hidden)?, &targets)?;
            adam.backward_step(&loss)?;
        }
        let left = candle_nn::loss::mse(&output.forward(&last_hidden()?)?, &targets)?.to_scalar::<f32>()?;
        Ok((lstm, output, f64::from(left).sqrt()))
    }

    /// The next values of a past.
    ///
    /// # Errors
    /// If the past is shorter than what the network looks back on.
    pub fn forecast(&self, past: &[f64], days: usize) -> Result<Vec<f64>, Error> {
        let changes: Vec<f32> =
            past.windows(2).map(|w| ((w[1] - w[0] - self.mean) / self.scale) as f32).collect();
        let from = changes.len().checked_sub(LOOK_BACK);
        let from = from.ok_or_else(|| Error::Unsuitable("the past is too short for the network".into()))?;
        self.run(&changes[from..], past[past.len() - 1], days).map_err(failed)
    }

    fn run(&self, recent: &[f32], mut level: f64, days: usize) -> Result<Vec<f64>, candle_core::Error> {
        let mut state: LSTMState = self.lstm.zero_state(1)?;
        let mut feed = |unit: f32| -> Result<f32, candle_core::Error> {
            state = self.lstm.step(&Tensor::from_vec(vec![unit], (1, 1), &Device::Cpu)?, &state)?;
            self.output.forward(state.h())?.flatten_all()?.to_vec1::<f32>().map(|v| v[0])
        };
        let mut next = 0.0;
        for unit in recent {
            next = feed(*unit)?;
        }
        let mut ahead = Vec::with_capacity(days);
        for _ in 0..days {
            level += f64::from(next) * self.scale + self.mean;
            ahead.push(level);
            next = feed(next)?;
        }
        Ok(ahead)
    }
}
