"""The words that files on disk hold, and that no renaming may touch: files of every lab, written years ago, have them.

Code may call a thing as it likes; what it writes and reads stays. tests/test_frozen_words.py collects the words from
the code and from recorded files (tests/words_in_files.py) and demands that they are these. A new word is added here, on
purpose, by hand. One that is gone or renamed is a mistake: a reader of old files needs it for ever. A line says
`place: word word`, `place =: word` are the values that a key may have, an indented line goes on.
"""

LEDGER_TABLES = """
events: attempt body hash kind seq t_ns trial
samples: block data form seq stream
sittings: body events hash head kind n
"""
"""Tables and columns of a session's ledger. A ledger is never changed in place, and its hash chains are over these."""
EVENT_KEYS = """
closed: at because
created: at
experimenter: do text which
experimenter go_on: do
experimenter note: do text
experimenter pause: do
experimenter repeat: do which
fault: device message what
opened: at environment
opened.environment: code packages palpate platform python
reply: answers at_s by go made pictures presented recorded rendered seconds streams switches
reply.made: force_N models
reply.made.models: force_model force_sha256 perception_model perception_sha256
reply.pictures: light surface
reply.rendered: compared deadlines met method model runtime seed sha256 weights weights_sha256
reply.rendered.compared: friction level_dB spectrum_dB
reply.rendered.deadlines: clock late steps underruns
reply.rendered.met: held muted quiet restarts sounding
reply.switches: at_s to
request: do
request ask: back do form items previous
request choose: past track
request confirm: do text what
request instruct: do page
request present: do stimulus wish
request rest: do done total
request sense: device do seconds
request show: page seconds
samples: streams
samples.form: channels count dtype rate_hz t0_ns units
session_ended: as trials
session_started: accepted_change calibration environment extensions group lab_forms participant plan rig row seed
    session study trials
session_started.environment: code packages palpate platform python
session_started.lab_forms: consent questions
session_started.rig: devices kind language settings twins window
trial_ended: as
trial_started: block stimulus
"""
"""Keys of the bodies of events, and of the notes of when a ledger was created, opened and closed (`sittings`).
A replay compares bodies byte by byte, and each is in the hash chain."""
EVENT_VALUES = """
ask.form: adjectives authoring consent demographics lexicon likert similarity sliders suggestions
channels of door: angle force
channels of door_angle: angle
channels of door_force: Fx Fy Fz Tx Ty Tz force
channels of door_position: seen x y z
channels of tool_acceleration: ax ay az x y z
channels of tool_force: Fx Fy Fz Tx Ty Tz x y z
channels of tool_position: seen x y z
closed.because: complete
events.kind: experimenter reply request session_ended session_started trial_ended trial_started
experimenter.do: go_on note pause repeat
experimenter.which: last this
reply.by: twin
reply.go: back try
request.do: ask instruct present rest sense
request.page: instructions
session_started.rig.kind: live simulated
sittings.kind: closed created opened
trial_ended.as: answered captured left repeated
units: 1 N N*m deg m/s^2 mm
"""
"""Words that recorded events have as values: kinds, forms, what was done, streams with their channels and units."""
LIVE_SESSIONS = """
anchor: attribute block id label number of value
answers: agreed felt further ticked words
closed: receipt
closed.because: interrupted
events.kind: fault samples
experimenter: by
experimenter.by: participant
experimenter.do: abort
lab_forms.questions: high kind levels low name optional text unit
reply: feel moves vibration
reply.by: experimenter
reply.recorded: drift_ppm gaps lost rate_hz samples
reply.vibration: blank hand_arm_m2_s3 level_db onset_ns rate_hz reference seconds sha256 waveform
request ask: anchor
request present: anchor live
request.do: confirm
samples.form: clock first
samples.streams: arrived calibration count device_s first gaps lost why
session_ended.as: aborted declined ineligible
trial_ended.as: faulted
"""
"""Words of events that only a session with real devices or people has, so that no recorded one holds them."""
FAULTS = """
fault.what: emergency_stop firmware heartbeat_lost limit link_lost not_a_number over_range overload overrun refused
    silent stuck underrun
"""
"""The words that faults are counted by: a ledger holds them, and analyses select by them."""
STUDIES = """
settings of ranking: again
study: adjectives analysis anchors ask attributes capture closing console eligible feedback groups instructions
    intervals interview lexicon live minutes navigation needs noise onset_ms opening order pairs participants practice
    procedure questionnaire questions rest resume scale settings setup sides simulation stimuli study task title
study.adjectives: further order words
study.adjectives.order =: as_listed random
study.adjectives.words: source word
study.analysis: families pooled within
study.anchors: before rated stimuli
study.anchors.before =: block session trial
study.anchors.stimuli: attribute id label value wish
study.ask choice: kind name of optional options text
study.ask choice.kind =: choice
study.ask choice.of =: intervals
study.ask confidence: ends kind name optional points text
study.ask confidence.kind =: confidence
study.ask number: above from high kind low name optional text to unit
study.ask number.kind =: number
study.ask scale: ends kind name optional scale text
study.ask scale.kind =: scale
study.ask text: kind longest name optional text
study.ask text.kind =: text
study.attributes: category explanation high low name outcome
study.capture: device seconds
study.capture.device =: camera door_sensors tool
study.closing =: interview questionnaire suggestions
study.console: blind
study.eligible: answer name text
study.eligible.answer =: no yes
study.feedback: after seconds
study.feedback.after =: all practice
study.intervals: at_once catch count design equal gap_s names seconds standard
study.intervals.catch: absent easy exclude_above
study.intervals.catch.absent: every
study.intervals.design =: forced_choice oddity same_different yes_no
study.interview: name text
study.lexicon: at_least
study.live: show_force
study.navigation =: back_and_forward forward
study.needs =: camera door door_generator door_sensors masking_noise samples skin_temperature texture_renderer tool
    vibration window
study.noise: at_most_db_a
study.onset_ms: max p50 p99
study.opening =: consent demographics eligibility
study.order: blocks design over_sessions repeats seed within
study.order.blocks: by design instructions
study.order.blocks.design =: as_listed latin random williams
study.order.design =: as_listed latin random williams
study.order.over_sessions =: mirrored next_row same
study.order.within =: block group
study.participants: apart_days per_group planned sessions
study.practice: at_most stimuli until
study.practice.until: correct of
study.procedure constant: easier kind level name repeats stimuli
study.procedure constant.easier =: higher lower
study.procedure constant.kind =: constant
study.procedure constant.level: column from high low of points to values
study.procedure constant.level.of =: stimuli
study.procedure limits: direction easier jitter kind level name step stimuli stop
study.procedure limits.direction =: alternating ascending descending
study.procedure limits.easier =: higher lower
study.procedure limits.kind =: limits
study.procedure limits.stop: at_least reversals series threshold_sd trials
study.procedure questplus: easier interest kind level model name stimuli stop
study.procedure questplus.easier =: higher lower
study.procedure questplus.interest =: gradient guess lapse slope threshold
study.procedure questplus.kind =: questplus
study.procedure questplus.model: gradient guess lapse scale shape slope threshold
study.procedure questplus.model.scale =: db linear log10
study.procedure questplus.model.shape =: gaussian logistic weibull
study.procedure questplus.model.threshold: from high low points spacing to
study.procedure questplus.model.threshold.spacing =: linear log
study.procedure staircase: down easier kind last level name start step stimuli stop up weight
study.procedure staircase.easier =: higher lower
study.procedure staircase.kind =: staircase
study.questionnaire: ends items points
study.rest: button every
study.resume: repeat within_h
study.resume.repeat =: block instructions
study.scale: from high labels length_mm low start step ticks to
study.scale.start =: unset
study.scale.ticks =: labels none steps
study.simulation: anchored answer_s bias_sd gain_sd kind lapse_rate latents noise_sd observer present_s revise_rate
    vocabulary
study.simulation.observer: guess lapse scale shape slope threshold threshold_sd yes
study.simulation.observer.scale =: db linear log10
study.simulation.observer.shape =: gaussian logistic weibull
study.stimuli: columns id sha256
study.task =: adjective_selection authoring capture free_lexicon intervals matching questions ranking similarity
    slider_rating
tasks: adjective_selection authoring capture free_lexicon intervals matching questions ranking similarity slider_rating
"""
"""Keys of a study. Its definition is stored in every ledger, and the digest of the plan is made of it."""
COLLECTED = """
anchors: attribute block felt label number seq session stimulus value
answers: form item kind number seq session value
choices: alternatives attempt block catch chosen confidence correct counts design hit level level_2 other participant
    practice procedure rt_s seq session session_number standard stimulus target track trial
events: attempt body hash kind seq session t_ns trial
fields: attempt block counts kind number participant practice question response_time_s seq session session_number trial
    value
ledgers: mtime_ns session size wal_mtime_ns wal_size
own_tables: name
palpate: version
participants: group_name participant row study
rankings: attempt attribute block counts participant position practice rank seq session session_number set_size
    stimulus trial
ratings: antonym attribute block group_name number participant practice response_time_s revised session simulated
    status stimulus study trial value
responses: antonym attempt attribute counts response_time_s revised session trial value
sessions: certificates duration_s events file file_sha256 first_hash group_name head_hash number palpate_version
    participant row seed session simulated sittings started_at status study study_digest trials_answered trials_planned
streams: attempt block channels clock first rate_hz samples seq session sha256 stream t0_ns trial units
studies: definition study study_digest title
switches: at_s n seq session side trial
trials: attempts block practice session status stimulus trial
words: attempt counts form kind n seq session trial word
"""
"""Tables and columns of the collected database. It can be made anew, but labs have queries and scripts on it."""
PARTICIPANTS = """
identities: consented contact name note pseudonym
lab.yaml: extensions registry
participants.json: Delimiter Description Levels Levels_ko LongName Maximum Minimum Question Question_ko Units Units_ko
    age driving_experience gender handedness participant_id studies took_part_before
participants.tsv: age driving_experience gender handedness participant_id studies took_part_before
registry: version
registry_allocations: at group_name participant replaces row status study
registry_audit: at body n what
registry_participants: added_at participant status
"""
"""A lab's files about people: the table and its description (BIDS), lab.yaml, the registry, the identities."""
STATIONS = """
rig.yaml: devices needs rig
rig.yaml accelerometer: bandwidth_hz buffer_s calibrated channels clipped_s driver full_scale_g kind noise_V range_V
    rate_hz scaled_at_V seed sensitivity_V_per_g stuck_s supply_V terminals zero_g_V
rig.yaml accelerometer.driver =: nidaqmx twin
rig.yaml accelerometer.kind =: accelerometer
rig.yaml accelerometer.terminals =: default diff nrse rse
rig.yaml camera: calibrated driver folder kind least_pixels least_sharpness lights most_white order pictures settle_s
    suffixes
rig.yaml camera.driver =: folder twin
rig.yaml camera.kind =: camera
rig.yaml camera.order =: name time
rig.yaml door: baud calibrated driver handle_radius_m kind limits port telemetry_hz time_limit_s twin_seed twin_speed
rig.yaml door.driver =: serial twin
rig.yaml door.kind =: door
rig.yaml door.limits: slope_Nm_deg speed_deg_s torque_Nm
rig.yaml force_torque: buffer_s calibrated calibration channels driver frame kind noise_V overload rate_hz seed still
    stuck_s terminals thermistor zero_s
rig.yaml force_torque.driver =: nidaqmx twin
rig.yaml force_torque.frame: dx_mm dy_mm dz_mm rx_deg ry_deg rz_deg
rig.yaml force_torque.kind =: force_torque
rig.yaml force_torque.terminals =: default diff nrse rse
rig.yaml force_torque.thermistor: bias_slopes channel gain_slopes reference_V
rig.yaml masking_noise: calibrated channels colour db_spl_at_0_dbfs device driver kind level_db_spl level_dbfs ramp_s
    rate_hz seed
rig.yaml masking_noise.colour =: pink white
rig.yaml masking_noise.driver =: sound twin
rig.yaml masking_noise.kind =: masking_noise
rig.yaml needs: camera door door_generator door_sensors masking_noise samples skin_temperature texture_renderer tool
    vibration
rig.yaml stage: baud calibrated driver key_confirms kind mount_s port
rig.yaml stage.driver =: barcode hand twin
rig.yaml stage.kind =: stage
rig.yaml tablet: axes calibrated cutoff_hz driver force force_N jitter_ms kind levels path px_per_mm recording
    report_hz screen seed speed_mm_s step_mm upsampling
rig.yaml tablet.axes: pressure x y
rig.yaml tablet.axes.x: least most per_mm
rig.yaml tablet.driver =: evdev pyglet recording twin
rig.yaml tablet.force: a_N b
rig.yaml tablet.kind =: tablet
rig.yaml tablet.screen: middle_mm number px_per_mm
rig.yaml tablet.upsampling =: hold line
rig.yaml thermometer: baud calibrated commands driver highest_degC input kind lowest_degC most_missed noise_degC place
    port rate_hz seed timeout_s
rig.yaml thermometer.commands =: lakeshore lines scpi
rig.yaml thermometer.driver =: serial twin
rig.yaml thermometer.kind =: thermometer
rig.yaml thermometer.place =: room skin
rig.yaml tracker: by calibrated channels drift_ppm driver hides kind marker noise_mm occlusion_s occlusions_per_s
    rate_hz reach_mm recording recover repeats seed seen seen_above silent_after_s silent_s stream unit wait_s
rig.yaml tracker.by =: name type
rig.yaml tracker.driver =: lsl recording twin
rig.yaml tracker.hides =: frozen nan zeros
rig.yaml tracker.kind =: tracker
rig.yaml tracker.unit =: cm m mm
rig.yaml vibrator: ahead_ms bits calibrated calibration certificate channel delay_ms device driver feed_s full_scale_V
    jitter_ms kind limits rate_hz seed
rig.yaml vibrator.certificate: bursts date late_ms level_dB most_ms p50_ms p99_ms sensor settings
rig.yaml vibrator.driver =: nidaqmx sound twin
rig.yaml vibrator.kind =: vibrator
rig.yaml vibrator.limits: a8_m_s2 hand_arm_m_s2 longest_s peak_V peak_m_s2 peak_um rms_V thermal_s window_s
rig.yaml voice_coil: ahead_ms calibrated calibration card_rate_hz channel device driver full_scale_V kind peak_V
    peak_m_s2 rms_V seed thermal_s
rig.yaml voice_coil.driver =: nidaqmx sound twin
rig.yaml voice_coil.kind =: voice_coil
streams of door_sensors: door_force door_position
streams of skin_temperature: skin_temperature
streams of tool: tool_acceleration tool_force tool_position
vibration: added_ms band_Hz before_dB boost_dB coherence date delay_ms excitation filter format gain_m_s2_V h2_apart_dB
    hz imaginary kind limited_Hz real ripple_dB
vibration.kind =: voice_coil_response
window.yaml: confirmed_at nominal_mm px_per_mm screen size_px
"""
"""A station's files: rig.yaml with the settings of every kind of device, window.yaml, the calibration of a voice coil.
A ledger holds the settings as they were."""
MODELS = """
attributes: attributes format interval learned method metrics name notes sight simulated tensors title told touch
    training weights
attributes.format =: palpate-attributes/1
authoring: a attributes b format name on saved
authoring.a: smoothing_deg wish
authoring.format =: palpate-authoring/1
authoring.on =: A B
card: format gives interval measured_on method metrics missed name notes steps takes texture title training weights
card.format =: palpate-model/1
card.interval: coverage half_width method
card.takes: antonyms kind names scale size unit within
card.takes.kind =: acceleration force_profile ratings spectrum texture_drive texture_window
card.texture: force_N hop id label peak_m_s2 picture rate_hz rms_m_s2 speed_mm_s start window
card.weights: bytes file sha256
design: force_N format models name predicted smoothing_deg wish
design.format =: palpate-design/1
library: attributes format notes simulated sources textures
library.format =: palpate-library/1
library.sources: file sha256 what
library.textures: category id label made_from picture predicted rated
library.textures.predicted: high learned low value
library.textures.rated: mean raters sd se
map: antonyms categories columns decimal delimiter duplicates encoding files format licence loop missing missing_value
    name scale source trim where
map.columns: attribute attribute_is between keep participant stimulus value within
map.columns.attribute: column contains levels
map.decimal =: , .
map.duplicates =: first mean refuse
map.format =: long psychopy
map.missing_value =: drop refuse
map.scale: from high low step to
map.where: is is_ not_empty
step activation: do function
step activation.function =: abs elu exp gelu leaky log relu sigmoid softmax softplus square tanh
step add: do kept
step affine: do gain offset
step attention: bias causal do heads memory out out_bias sparse weight
step autoregression: do frequencies log_sd per points triangles
step cartesian: do
step clip: do high low
step conv: bias do pad weight
step dense: bias do weight
step door_features: do names
step forest: do feature left right roots threshold value
step join: do kept
step keep: do kept
step kernel: do length points variance weights
step lstm: bias do reverse state weight
step max_pool: do size
step mean: do members
step nearest: do points values
step norm: bias do tiny weight
step part: along do start stop
step part.along =: channels length
step playable: do force_N slope_N_deg
step polar: do
step recall: do kept
step reshape: do shape
step residual: do steps
step turn: do
step upsample: do times
"""
"""Cards of trained models with their steps, designs of doors, libraries of textures, maps for importing: files of a lab
that a rig, a later version or another lab reads."""
ANALYSIS_PLANS = """
figure: figure name normalise outcomes source table tests title where
figure bubbles: by colour label reversed size span x y
figure bubbles.span =: data scale
figure class_heatmap: actual attribute by measure order predicted stimulus unit
figure class_heatmap.measure =: MAE RMSE
figure class_heatmap.order =: error given
figure estimates: high label low sort value
figure estimates.sort =: as_listed by_value
figure likert: ends form letters order points style
figure likert.order =: given mean
figure likert.style =: bars boxes
figure map: class_column dimensions ellipses items label_column over vectors
figure matching: attribute_column target
figure means: by confidence families whiskers
figure means.whiskers =: between cousineau_morey loftus_masson none sd
figure order_effect: adjust bins carry_over confidence position response_time stimulus
figure order_effect.adjust =: none stimulus
figure posterior: columns
figure power_law: people
figure predicted: actual attribute band colour high low panels predicted sd stimulus unit
figure predicted.band =: global panel
figure psychometric: columns
figure raincloud: by confidence families whiskers
figure raincloud.whiskers =: none
figure rating_heatmap: by order
figure rating_heatmap.order =: number similarity
figure similarity_bars: bars clusters confidence dots each p stars whiskers
figure similarity_bars.whiskers =: between cousineau_morey sd
figure track: columns
figure treemap: height_in threshold width_in words
figure treemap.words =: all kept
figure trends: by confidence families whiskers
figure trends.whiskers =: between cousineau_morey loftus_masson none sd
figure violins: actual attribute by order predicted signed stimulus unit value
figure violins.order =: given median
figure.normalise =: none range_within_participant to_-100_100 to_0_100 z_within_participant
figure.source =: choices forms ratings table words
plan: alpha draws exclusions figures least_people missing normalise seed sessions study tables tests title
plan.exclusions: because faster_than_s fewer_than flagged outlying participants slower_than_s where
plan.exclusions.outlying: sd within
plan.exclusions.where: from high low to
plan.missing =: listwise mixed_model refuse
plan.normalise =: none range_within_participant to_-100_100 to_0_100 z_within_participant
plan.sessions =: also_interrupted complete
test: missing name normalise outcomes source table test value where
test adjective_pairs: antonyms need_both new_words normalisation threshold
test adjective_pairs.normalisation =: any_stimulus share_of_maximum share_of_trials
test aligned_ranks: between sum_of_squares within
test aligned_ranks.sum_of_squares =: II III
test anova: between correction eta interval sum_of_squares within
test anova.correction =: GG HF none
test anova.eta =: generalized partial
test anova.sum_of_squares =: II III
test binomial_mixed_model: condition confidence correct level link n nodes random
test binomial_mixed_model.link =: logit probit
test binomial_mixed_model.random =: intercept intercept_and_condition intercept_and_slope
test bradley_terry: confidence correction count first independent loser participant reference tie winner
test bradley_terry.correction =: bonferroni holm none
test bradley_terry.independent =: choices participants
test categories: by confidence correction over reversed
test categories.correction =: bonferroni holm none
test cochran: exact factor yes
test cronbach_alpha: cases confidence items reverse
test dprime: by confidence correction model
test dprime.correction =: log_linear none when_extreme
test dprime.model =: differencing independent_observation
test equivalence: bounds bounds_dz factor
test friedman: confidence exact factor
test icc: confidence raters targets
test kendall_w: p raters targets
test kendall_w.p =: auto chi2 exact permutation
test krippendorff_alpha: confidence level raters units
test krippendorff_alpha.level =: interval nominal ordinal ratio
test lexicon: inflected kinds lists normalisation synonyms
test lexicon.normalisation =: as_written case_and_spaces spaces
test likert: by form points
test mds: confidence dimensions items meaning method over pairs reference replications scaled scree starts ties top
test mds.meaning =: dissimilarity similarity
test mds.method =: classical nonmetric
test mds.ties =: primary secondary
test means: by confidence interval
test means.interval =: between cousineau_morey loftus_masson none
test mixed_model: coding confidence fixed interactions levels numeric profile random reml uncorrelated
test mixed_model.coding =: sum treatment
test nemenyi: factor ties
test ordinal_model: coding confidence fixed interactions link numeric random
test ordinal_model.coding =: sum treatment
test ordinal_model.link =: logit probit
test ordinal_model.random =: participant
test pairs: correction factor family interval
test pairs.correction =: bonferroni holm none
test pca: confidence draws items over reference scaled
test pca.reference =: none normal permuted
test power_law: confidence intensity
test procrustes: confidence dimensions draws groups halves items on over reflection scaled starts stretch ties
test procrustes.on =: attributes classical nonmetric pca
test procrustes.ties =: primary secondary
test psychometric: alternatives by confidence correct draws easy_catch falling function guess interval jnd lapse last
    level level_unit method n order prior staircase task threshold
test psychometric.easy_catch =: counted left_out
test psychometric.function =: gaussian logistic weibull weibull_db
test psychometric.interval =: bootstrap corrected none posterior profile
test psychometric.jnd =: half_interquartile x84_x50
test psychometric.level_unit =: db linear
test psychometric.method =: constant staircase
test psychometric.prior =: declared_model levels
test psychometric.task =: forced_choice symmetric yes_no
test raters: least_r targets
test relevance: confidence draws interval normalisation threshold
test relevance.interval =: bca percentile
test relevance.normalisation =: any_stimulus share_of_maximum share_of_trials
test retest: confidence order targets
test target_error: attribute_column confidence target target_scale
test thurstone: confidence correction count independent loser method participant reference winner
test thurstone.correction =: bonferroni holm none
test thurstone.independent =: choices participants
test thurstone.method =: least_squares likelihood
test trends: category confidence correction families family numeric pooled reference reversed
test trends.category =: mean none
test trends.correction =: bonferroni holm none
test vectors: dimensions draws items on over scaled starts ties
test vectors.on =: classical nonmetric pca
test vectors.ties =: primary secondary
test wilcoxon: confidence correction factor family zeros
test wilcoxon.correction =: bonferroni holm none
test wilcoxon.zeros =: pratt wilcoxon
test word_agreement: confidence
test.missing =: listwise mixed_model refuse
test.normalise =: none range_within_participant to_-100_100 to_0_100 z_within_participant
test.source =: choices forms ratings table words
"""
"""Keys of an analysis plan, and of each kind of test and figure: plans are registered before the data are collected."""
STATISTICS = """
statistics.json: exclusions figures inputs participants plan simulated simulation_seeds software study tests title
    trials
statistics.json.exclusions: into rows what who why
statistics.json.figures: figure name refused
statistics.json.inputs: name note sha256
statistics.json.plan: alpha draws file missing normalise seed sessions sha256
statistics.json.software: matplotlib numpy palpate pandas python scipy
statistics.json.tests: asked headline inputs_sha256 kinds method missing more name notes outcome participants refused
    results seconds test values
statistics.json.tests.kinds of adjective_pairs: antonym_kept relevance relevance_antonym relevance_word word_kept
statistics.json.tests.kinds of anova: F W chi2 contrasts df df1 df2 epsilon_greenhouse_geisser epsilon_huynh_feldt
    error_sum_of_squares generalized_eta_squared generalized_eta_squared_high generalized_eta_squared_low mean_square p
    p_anderson p_greenhouse_geisser p_huynh_feldt p_uncorrected partial_eta_squared partial_eta_squared_high
    partial_eta_squared_low sum_of_squares
statistics.json.tests.kinds of cronbach_alpha: alpha alpha_if_dropped average_r cases ci_high ci_low item_rest
    item_total items mean sd standardised
statistics.json.tests.kinds of equivalence: bound_high bound_low df equivalent interval_high interval_low
    mean_difference p p_high p_low t_high t_low
statistics.json.tests.kinds of friedman: F F_ddof1 F_ddof2 W W_high W_low chi2 ddof1 k n p_F p_exact p_unc tied
statistics.json.tests.kinds of icc: F ICC ci_high ci_low df1 df2 p
statistics.json.tests.kinds of kendall_w: W chi2 df mean_rank_r p p_chi2 raters raters_with_ties targets
statistics.json.tests.kinds of lexicon: mentions participants stimuli words words_of_its_own
statistics.json.tests.kinds of likert: agree disagree mean median missing n n_1 n_2 n_3 n_4 n_5 n_6 n_7 q1 q3 sd
    share_1 share_2 share_3 share_4 share_5 share_6 share_7
statistics.json.tests.kinds of mds: angle_deg centre_1 centre_2 confidence cov_xy dim1 dim2 dimensions disparity
    dissimilarity distance draws mean observed p quantile_05 reached semi_major semi_minor shift start starts stress
    var_x var_y
statistics.json.tests.kinds of means: ci_high ci_low half mean n ratings_max ratings_min sd sd_interval
statistics.json.tests.kinds of mixed_model: F aic bic ci_high ci_low conditional_r2 correlation covariance ddof1 ddof2
    deviance df estimate icc levels log_likelihood marginal_r2 p p_unc parameters sd se singular t values variance
statistics.json.tests.kinds of pairs: ci95_high ci95_low cohens_dz cohens_dz_high cohens_dz_low df family
    mean_difference p p_uncorrected t
statistics.json.tests.kinds of pca: ci_high ci_low correlation_pc1 correlation_pc2 correlation_pc3 correlation_pc4
    cumulative direction_pc1 direction_pc2 direction_pc3 direction_pc4 kept p pc1 pc2 pc3 pc4 reference_mean
    reference_quantile share variance
statistics.json.tests.kinds of raters: flagged missing n r_others shared shift spread threshold value values
statistics.json.tests.kinds of relevance: ci_high ci_low kept kept_chance participants relevance stimuli ticks
statistics.json.tests.kinds of target_error: bias ci_high ci_low df mean_absolute_error n p sd t target
statistics.json.tests.kinds of trends: ci_high ci_low df dz family_size levels mean n p p_corrected sd t
statistics.json.tests.kinds of vectors: F df1 df2 dim1 dim2 direction_1 direction_2 p p_F r r2
statistics.json.tests.kinds of word_agreement: alpha ci_high ci_low jaccard kappa participants share_ticked stimuli
    words_per_participant
statistics.json.tests.missing: cells left_out participants_with_gaps policy
"""
"""Keys of statistics.json, and names of columns in it: papers and scripts read it, and recorded ones are compared."""
