//! Why there is no campaign, in the words of the user's options.

use cohaptic_campaign::CampaignError;
use cohaptic_scene::Diagnostic;

use crate::arguments::CampaignArguments;
use crate::failure::Failure;
use crate::output;

pub(super) fn failure(error: CampaignError, arguments: &CampaignArguments) -> Failure {
    match error {
        CampaignError::Scene { error, varied } => {
            let culprit = error.diagnostic().and_then(Diagnostic::override_text).map(str::to_owned);
            let is_varied = culprit.is_some_and(|culprit| varied.contains(&culprit));
            Failure::Combination { error, is_varied, combination: combination(&varied) }
        }
        CampaignError::NotRun { message, varied } => {
            Failure::Input(format!("{}: {message}{}", output::path(&arguments.scene.scene), combination(&varied)))
        }
        error @ (CampaignError::Vary(_) | CampaignError::SameKey { .. }) => Failure::Input(format!("--vary: {error}")),
        error @ CampaignError::Seeds { .. } => Failure::Input(format!("--runs: {error}")),
        error @ CampaignError::Size(_) => Failure::Input(error.to_string()),
        error @ (CampaignError::NoFolder { .. } | CampaignError::Foreign { .. } | CampaignError::Other { .. }) => {
            Failure::Input(format!("--out: {error}"))
        }
        error @ CampaignError::Stopped => Failure::Interrupted(error.to_string()),
        error @ (CampaignError::Damaged { .. } | CampaignError::Busy { .. } | CampaignError::File { .. } | _) => Failure::System(error.to_string()),
    }
}

/// A line on which combination it is; empty if there is but one.
fn combination(varied: &[String]) -> String {
    if varied.is_empty() { String::new() } else { format!("\nnote: in the combination {}", varied.join(", ")) }
}
