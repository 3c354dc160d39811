-- TMCL for Wireshark and tshark: datagrams in mnemonics with the names of parameters.
--
-- Put this file into Wireshark's folder of personal Lua plugins (Help, About, Folders), or:
--   tshark -X lua_script:tools/wireshark/tmcl.lua -r FILE.pcapng
--
-- It reads what `--trace FILE.pcapng` of the gradus commands records (serial datagrams as USER0, CAN frames as SocketCAN),
-- and TMCL over TCP on port 4322 (Decode As for others). The preference `module` chooses whose parameters are named.

local tmcl = Proto("tmcl", "TMCL")

-- What follows up to the next line of equals signs is made from the catalogue, by `TRYCMD=overwrite cargo test -p gradus
-- --test wireshark`.
-- =====================================================================================================================
local COMMAND = {
    [1] = "ROR",
    [2] = "ROL",
    [3] = "MST",
    [4] = "MVP",
    [5] = "SAP",
    [6] = "GAP",
    [7] = "STAP",
    [8] = "RSAP",
    [9] = "SGP",
    [10] = "GGP",
    [11] = "STGP",
    [12] = "RSGP",
    [13] = "RFS",
    [14] = "SIO",
    [15] = "GIO",
    [16] = "SAPX",
    [17] = "GAPX",
    [18] = "AAPX",
    [19] = "CALC",
    [20] = "COMP",
    [21] = "JC",
    [22] = "JA",
    [23] = "CSUB",
    [24] = "RSUB",
    [25] = "EI",
    [26] = "DI",
    [27] = "WAIT",
    [28] = "STOP",
    [29] = "SAC",
    [30] = "SCO",
    [31] = "GCO",
    [32] = "CCO",
    [33] = "CALCX",
    [34] = "AAP",
    [35] = "AGP",
    [36] = "CLE",
    [37] = "VECT",
    [38] = "RETI",
    [39] = "ACO",
    [40] = "CALCVV",
    [41] = "CALCVA",
    [42] = "CALCAV",
    [43] = "CALCVX",
    [44] = "CALCXV",
    [45] = "CALCV",
    [46] = "MVPA",
    [47] = "MVPXA",
    [48] = "RST",
    [49] = "DJNZ",
    [50] = "ROLA",
    [51] = "RORA",
    [52] = "ROLXA",
    [53] = "RORXA",
    [54] = "MSTX",
    [55] = "SIV",
    [56] = "GIV",
    [57] = "AIV",
    [64] = "UF0",
    [65] = "UF1",
    [66] = "UF2",
    [67] = "UF3",
    [68] = "UF4",
    [69] = "UF5",
    [70] = "UF6",
    [71] = "UF7",
    [80] = "CALL",
    [128] = "stop application",
    [129] = "run application",
    [130] = "step application",
    [131] = "reset application",
    [132] = "enter download mode",
    [133] = "exit download mode",
    [134] = "read program memory",
    [135] = "get application status",
    [136] = "get firmware version",
    [137] = "restore factory settings",
    [138] = "request target position reached event",
    [139] = "enter ASCII mode",
    [141] = "breakpoints",
    [142] = "capture samples",
    [146] = "write a register of a chip",
    [148] = "read a register of a chip",
    [157] = "get information",
    [255] = "software reset",
}
local READS_AXIS = { [5] = true, [6] = true, [7] = true, [8] = true, [16] = true, [17] = true, [18] = true, [34] = true, }
local READS_GLOBAL = { [9] = true, [10] = true, [11] = true, [12] = true, [35] = true, }
local AXIS = {
    ["TMCM-3351"] = {
        [0] = "target_position",
        [1] = "actual_position",
        [2] = "target_speed",
        [3] = "actual_speed",
        [4] = "maximum_positioning_speed",
        [5] = "maximum_acceleration",
        [6] = "maximum_current",
        [7] = "standby_current",
        [8] = "position_reached_flag",
        [9] = "home_switch_state",
        [10] = "right_limit_switch_state",
        [11] = "left_limit_switch_state",
        [12] = "right_limit_switch_enable_polarity",
        [13] = "left_limit_switch_enable_polarity",
        [14] = "ramp_type",
        [15] = "start_velocity",
        [16] = "start_acceleration",
        [17] = "maximum_deceleration",
        [18] = "break_velocity",
        [19] = "final_deceleration",
        [20] = "stop_velocity",
        [21] = "stop_deceleration",
        [22] = "bow_1",
        [23] = "bow_2",
        [24] = "bow_3",
        [25] = "bow_4",
        [26] = "virtual_stop_left",
        [27] = "virtual_stop_right",
        [28] = "virtual_stop_enable",
        [29] = "virtual_stop_mode",
        [33] = "swap_stop_switches",
        [34] = "enable_soft_stop",
        [35] = "bow_scaling_factor",
        [50] = "torque_mode",
        [108] = "cl_gamma_vmin",
        [109] = "cl_gamma_vmax",
        [110] = "cl_maximum_gamma",
        [111] = "cl_beta",
        [112] = "cl_offset",
        [113] = "cl_current_minimum",
        [114] = "cl_current_maximum",
        [115] = "cl_correction_velocity_p",
        [116] = "cl_correction_velocity_i",
        [117] = "cl_correction_velocity_i_clipping",
        [118] = "cl_correction_velocity_dv_clock",
        [119] = "cl_correction_velocity_dv_clipping",
        [120] = "cl_upscale_delay",
        [121] = "cl_downscale_delay",
        [123] = "actual_scaler_value",
        [124] = "cl_correction_position_p",
        [125] = "cl_max_correction_tolerance",
        [126] = "cl_start_up",
        [127] = "relative_positioning_option",
        [129] = "closed_loop_mode",
        [131] = "measured_speed",
        [132] = "current_measured_speed",
        [133] = "closed_loop_init_flag",
        [134] = "positioning_window",
        [136] = "encmeanwait",
        [137] = "encmeanfilter",
        [138] = "encmeanint",
        [140] = "microstep_resolution",
        [150] = "encoder_input_sample_rate",
        [151] = "encoder_input_filter_length",
        [162] = "chopper_blank_time",
        [163] = "constant_toff_mode",
        [164] = "disable_fast_decay_comparator",
        [165] = "chopper_hysteresis_end_fast_decay_time",
        [166] = "chopper_hysteresis_start_sine_wave_offset",
        [167] = "chopper_off_time",
        [168] = "smartenergy_current_minimum",
        [169] = "smartenergy_current_down_step",
        [170] = "smartenergy_hysteresis",
        [171] = "smartenergy_current_up_step",
        [172] = "smartenergy_hysteresis_start",
        [173] = "stallguard2_filter_enable",
        [174] = "stallguard2_threshold",
        [177] = "short_to_ground_protection",
        [179] = "vsense",
        [180] = "smartenergy_actual_current",
        [181] = "stop_on_stall",
        [182] = "smartenergy_threshold_speed",
        [184] = "random_toff_mode",
        [185] = "chopper_synchronization",
        [186] = "pwm_threshold_speed",
        [187] = "pwm_gradient",
        [188] = "pwm_amplitude",
        [189] = "pwm_scale",
        [190] = "pwm_mode",
        [191] = "pwm_frequency",
        [192] = "pwm_autoscale",
        [193] = "reference_search_mode",
        [194] = "reference_search_speed",
        [195] = "reference_switch_speed",
        [196] = "end_switch_distance",
        [197] = "last_reference_position",
        [198] = "latched_actual_position",
        [199] = "latched_encoder_position",
        [200] = "boost_current",
        [201] = "encoder_mode",
        [202] = "motor_full_step_resolution",
        [204] = "freewheeling_mode",
        [206] = "actual_load_value",
        [207] = "extended_error_flags",
        [208] = "motor_driver_error_flags",
        [209] = "encoder_position",
        [210] = "encoder_resolution",
        [212] = "maximum_encoder_deviation",
        [213] = "maximum_velocity_deviation",
        [214] = "power_down_delay",
        [249] = "group_index",
        [251] = "reverse_shaft",
        [255] = "unit_mode",
    },
    ["TMCM-1617"] = {
        [0] = "adc_i0_raw",
        [1] = "adc_i1_raw",
        [2] = "adc_i0",
        [3] = "adc_i1",
        [4] = "adc_i2",
        [5] = "adc_i0_offset",
        [6] = "adc_i1_offset",
        [10] = "motor_pole_pairs",
        [11] = "maximum_current",
        [12] = "open_loop_current",
        [13] = "motor_direction",
        [14] = "motor_type",
        [15] = "commutation_mode",
        [16] = "open_loop_commutation_angle",
        [17] = "encoder_commutation_angle",
        [18] = "digital_hall_commutation_angle",
        [25] = "position_sensor_selection",
        [26] = "velocity_sensor_selection",
        [27] = "velocity_unit_selection",
        [30] = "target_current",
        [31] = "actual_current",
        [32] = "target_flux",
        [33] = "actual_flux",
        [40] = "target_velocity",
        [41] = "ramp_velocity",
        [42] = "actual_velocity",
        [43] = "maximum_velocity",
        [44] = "acceleration",
        [45] = "enable_velocity_ramp",
        [47] = "motor_halted_velocity",
        [50] = "target_position",
        [51] = "ramp_position",
        [52] = "actual_position",
        [53] = "position_reached_distance",
        [54] = "position_reached_velocity",
        [55] = "position_reached_flag",
        [56] = "position_scaler",
        [70] = "torque_p",
        [71] = "torque_i",
        [72] = "velocity_p",
        [73] = "velocity_i",
        [74] = "position_p",
        [75] = "torque_pi_error_sum",
        [76] = "flux_pi_error_sum",
        [77] = "velocity_pi_error_sum",
        [78] = "torque_pi_error",
        [79] = "flux_pi_error",
        [80] = "velocity_pi_error",
        [81] = "position_pi_error",
        [90] = "hall_polarity",
        [91] = "hall_direction",
        [92] = "hall_interpolation",
        [93] = "hall_phi_e_offset",
        [94] = "hall_inputs",
        [100] = "encoder_steps",
        [101] = "encoder_direction",
        [102] = "encoder_init_mode",
        [103] = "encoder_init_state",
        [104] = "encoder_init_delay",
        [105] = "encoder_init_velocity",
        [106] = "encoder_offset",
        [107] = "clear_on_null",
        [108] = "clear_once",
        [109] = "encoder_inputs",
        [110] = "motor_pwm_frequency",
        [140] = "enable_brake_chopper",
        [141] = "brake_chopper_voltage_limit",
        [142] = "brake_chopper_hysteresis",
        [144] = "brake_chopper_active",
        [156] = "status_flags",
        [209] = "reference_switch_enable",
        [210] = "reference_switch_polarity",
        [211] = "right_reference_switch_active",
        [212] = "left_reference_switch_active",
        [213] = "home_reference_switch_active",
        [220] = "supply_voltage",
        [221] = "driver_temperature",
        [230] = "main_loops",
        [231] = "torque_loops",
        [232] = "velocity_loops",
        [240] = "debug_value_0",
        [241] = "debug_value_1",
        [242] = "debug_value_2",
        [243] = "debug_value_3",
        [244] = "debug_value_4",
        [245] = "debug_value_5",
        [246] = "debug_value_6",
        [247] = "debug_value_7",
        [248] = "debug_value_8",
        [249] = "debug_value_9",
        [255] = "enable_driver",
    },
    ["TMCM-351"] = {
        [0] = "target_next_position",
        [1] = "actual_position",
        [2] = "target_next_speed",
        [3] = "actual_speed",
        [4] = "maximum_positioning_speed",
        [5] = "maximum_acceleration",
        [6] = "absolute_max_current",
        [7] = "standby_current",
        [8] = "target_pos_reached",
        [9] = "ref_switch_status",
        [10] = "right_limit_switch_status",
        [11] = "left_limit_switch_status",
        [12] = "right_limit_switch_disable",
        [13] = "left_limit_switch_disable",
        [130] = "minimum_speed",
        [135] = "actual_acceleration",
        [138] = "ramp_mode",
        [140] = "microstep_resolution",
        [141] = "reference_switch_tolerance",
        [149] = "soft_stop_flag",
        [153] = "ramp_divisor",
        [154] = "pulse_divisor",
        [193] = "referencing_mode",
        [194] = "referencing_search_speed",
        [195] = "referencing_switch_speed",
        [196] = "distance_end_switches",
        [197] = "last_reference_position",
        [200] = "boost_current",
        [203] = "mixed_decay_threshold",
        [204] = "freewheeling",
        [205] = "stall_detection_threshold",
        [206] = "actual_load_value",
        [207] = "extended_error_flags",
        [208] = "driver_error_flags",
        [209] = "encoder_position",
        [210] = "encoder_prescaler",
        [211] = "fullstep_threshold",
        [212] = "maximum_encoder_deviation",
        [213] = "group_index",
        [214] = "power_down_delay",
    },
}
local GLOBAL = {
    ["TMCM-3351"] = {
        [0] = { [65] = "rs232_and_rs485_baud_rate", [66] = "serial_address", [68] = "serial_heartbeat", [69] = "can_bit_rate", [70] = "can_reply_id", [71] = "can_id", [75] = "telegram_pause_time", [76] = "serial_host_address", [77] = "auto_start_mode", [81] = "tmcl_code_protection", [82] = "can_heartbeat", [83] = "can_secondary_address", [84] = "coordinate_storage", [85] = "do_not_restore_user_variables", [87] = "serial_secondary_address", [128] = "tmcl_application_status", [129] = "download_mode", [130] = "tmcl_program_counter", [131] = "last_tmcl_error", [132] = "tmcl_tick_timer", [133] = "random_number", [255] = "suppress_reply", },
        [2] = { [0] = "user_variable_0", [1] = "user_variable_1", [2] = "user_variable_2", [3] = "user_variable_3", [4] = "user_variable_4", [5] = "user_variable_5", [6] = "user_variable_6", [7] = "user_variable_7", [8] = "user_variable_8", [9] = "user_variable_9", [10] = "user_variable_10", [11] = "user_variable_11", [12] = "user_variable_12", [13] = "user_variable_13", [14] = "user_variable_14", [15] = "user_variable_15", [16] = "user_variable_16", [17] = "user_variable_17", [18] = "user_variable_18", [19] = "user_variable_19", [20] = "user_variable_20", [21] = "user_variable_21", [22] = "user_variable_22", [23] = "user_variable_23", [24] = "user_variable_24", [25] = "user_variable_25", [26] = "user_variable_26", [27] = "user_variable_27", [28] = "user_variable_28", [29] = "user_variable_29", [30] = "user_variable_30", [31] = "user_variable_31", [32] = "user_variable_32", [33] = "user_variable_33", [34] = "user_variable_34", [35] = "user_variable_35", [36] = "user_variable_36", [37] = "user_variable_37", [38] = "user_variable_38", [39] = "user_variable_39", [40] = "user_variable_40", [41] = "user_variable_41", [42] = "user_variable_42", [43] = "user_variable_43", [44] = "user_variable_44", [45] = "user_variable_45", [46] = "user_variable_46", [47] = "user_variable_47", [48] = "user_variable_48", [49] = "user_variable_49", [50] = "user_variable_50", [51] = "user_variable_51", [52] = "user_variable_52", [53] = "user_variable_53", [54] = "user_variable_54", [55] = "user_variable_55", [56] = "user_variable_56", [57] = "user_variable_57", [58] = "user_variable_58", [59] = "user_variable_59", [60] = "user_variable_60", [61] = "user_variable_61", [62] = "user_variable_62", [63] = "user_variable_63", [64] = "user_variable_64", [65] = "user_variable_65", [66] = "user_variable_66", [67] = "user_variable_67", [68] = "user_variable_68", [69] = "user_variable_69", [70] = "user_variable_70", [71] = "user_variable_71", [72] = "user_variable_72", [73] = "user_variable_73", [74] = "user_variable_74", [75] = "user_variable_75", [76] = "user_variable_76", [77] = "user_variable_77", [78] = "user_variable_78", [79] = "user_variable_79", [80] = "user_variable_80", [81] = "user_variable_81", [82] = "user_variable_82", [83] = "user_variable_83", [84] = "user_variable_84", [85] = "user_variable_85", [86] = "user_variable_86", [87] = "user_variable_87", [88] = "user_variable_88", [89] = "user_variable_89", [90] = "user_variable_90", [91] = "user_variable_91", [92] = "user_variable_92", [93] = "user_variable_93", [94] = "user_variable_94", [95] = "user_variable_95", [96] = "user_variable_96", [97] = "user_variable_97", [98] = "user_variable_98", [99] = "user_variable_99", [100] = "user_variable_100", [101] = "user_variable_101", [102] = "user_variable_102", [103] = "user_variable_103", [104] = "user_variable_104", [105] = "user_variable_105", [106] = "user_variable_106", [107] = "user_variable_107", [108] = "user_variable_108", [109] = "user_variable_109", [110] = "user_variable_110", [111] = "user_variable_111", [112] = "user_variable_112", [113] = "user_variable_113", [114] = "user_variable_114", [115] = "user_variable_115", [116] = "user_variable_116", [117] = "user_variable_117", [118] = "user_variable_118", [119] = "user_variable_119", [120] = "user_variable_120", [121] = "user_variable_121", [122] = "user_variable_122", [123] = "user_variable_123", [124] = "user_variable_124", [125] = "user_variable_125", [126] = "user_variable_126", [127] = "user_variable_127", [128] = "user_variable_128", [129] = "user_variable_129", [130] = "user_variable_130", [131] = "user_variable_131", [132] = "user_variable_132", [133] = "user_variable_133", [134] = "user_variable_134", [135] = "user_variable_135", [136] = "user_variable_136", [137] = "user_variable_137", [138] = "user_variable_138", [139] = "user_variable_139", [140] = "user_variable_140", [141] = "user_variable_141", [142] = "user_variable_142", [143] = "user_variable_143", [144] = "user_variable_144", [145] = "user_variable_145", [146] = "user_variable_146", [147] = "user_variable_147", [148] = "user_variable_148", [149] = "user_variable_149", [150] = "user_variable_150", [151] = "user_variable_151", [152] = "user_variable_152", [153] = "user_variable_153", [154] = "user_variable_154", [155] = "user_variable_155", [156] = "user_variable_156", [157] = "user_variable_157", [158] = "user_variable_158", [159] = "user_variable_159", [160] = "user_variable_160", [161] = "user_variable_161", [162] = "user_variable_162", [163] = "user_variable_163", [164] = "user_variable_164", [165] = "user_variable_165", [166] = "user_variable_166", [167] = "user_variable_167", [168] = "user_variable_168", [169] = "user_variable_169", [170] = "user_variable_170", [171] = "user_variable_171", [172] = "user_variable_172", [173] = "user_variable_173", [174] = "user_variable_174", [175] = "user_variable_175", [176] = "user_variable_176", [177] = "user_variable_177", [178] = "user_variable_178", [179] = "user_variable_179", [180] = "user_variable_180", [181] = "user_variable_181", [182] = "user_variable_182", [183] = "user_variable_183", [184] = "user_variable_184", [185] = "user_variable_185", [186] = "user_variable_186", [187] = "user_variable_187", [188] = "user_variable_188", [189] = "user_variable_189", [190] = "user_variable_190", [191] = "user_variable_191", [192] = "user_variable_192", [193] = "user_variable_193", [194] = "user_variable_194", [195] = "user_variable_195", [196] = "user_variable_196", [197] = "user_variable_197", [198] = "user_variable_198", [199] = "user_variable_199", [200] = "user_variable_200", [201] = "user_variable_201", [202] = "user_variable_202", [203] = "user_variable_203", [204] = "user_variable_204", [205] = "user_variable_205", [206] = "user_variable_206", [207] = "user_variable_207", [208] = "user_variable_208", [209] = "user_variable_209", [210] = "user_variable_210", [211] = "user_variable_211", [212] = "user_variable_212", [213] = "user_variable_213", [214] = "user_variable_214", [215] = "user_variable_215", [216] = "user_variable_216", [217] = "user_variable_217", [218] = "user_variable_218", [219] = "user_variable_219", [220] = "user_variable_220", [221] = "user_variable_221", [222] = "user_variable_222", [223] = "user_variable_223", [224] = "user_variable_224", [225] = "user_variable_225", [226] = "user_variable_226", [227] = "user_variable_227", [228] = "user_variable_228", [229] = "user_variable_229", [230] = "user_variable_230", [231] = "user_variable_231", [232] = "user_variable_232", [233] = "user_variable_233", [234] = "user_variable_234", [235] = "user_variable_235", [236] = "user_variable_236", [237] = "user_variable_237", [238] = "user_variable_238", [239] = "user_variable_239", [240] = "user_variable_240", [241] = "user_variable_241", [242] = "user_variable_242", [243] = "user_variable_243", [244] = "user_variable_244", [245] = "user_variable_245", [246] = "user_variable_246", [247] = "user_variable_247", [248] = "user_variable_248", [249] = "user_variable_249", [250] = "user_variable_250", [251] = "user_variable_251", [252] = "user_variable_252", [253] = "user_variable_253", [254] = "user_variable_254", [255] = "user_variable_255", },
        [3] = { [0] = "timer_0_period", [1] = "timer_1_period", [2] = "timer_2_period", [27] = "stop_left_0_trigger_transition", [28] = "stop_right_0_trigger_transition", [29] = "stop_left_1_trigger_transition", [30] = "stop_right_1_trigger_transition", [31] = "stop_left_2_trigger_transition", [32] = "stop_right_2_trigger_transition", [39] = "input_0_trigger_transition", [40] = "input_1_trigger_transition", [41] = "input_2_trigger_transition", [42] = "input_3_trigger_transition", [43] = "input_4_trigger_transition", [44] = "input_5_trigger_transition", [45] = "input_6_trigger_transition", [46] = "input_7_trigger_transition", },
    },
    ["TMCM-1617"] = {
        [0] = { [65] = "rs232_rs485_baud_rate", [66] = "serial_address", [69] = "can_bit_rate", [70] = "can_reply_id", [71] = "can_id", [75] = "telegram_pause_time", [76] = "serial_host_address", [77] = "auto_start_mode", [81] = "tmcl_code_protection", [82] = "can_heartbeat", [83] = "can_secondary_address", [85] = "do_not_restore_user_variables", [128] = "tmcl_application_status", [129] = "download_mode", [130] = "tmcl_program_counter", [131] = "last_tmcl_error", [132] = "tmcl_tick_timer", [255] = "suppress_reply", },
        [2] = { [0] = "user_variable_0", [1] = "user_variable_1", [2] = "user_variable_2", [3] = "user_variable_3", [4] = "user_variable_4", [5] = "user_variable_5", [6] = "user_variable_6", [7] = "user_variable_7", [8] = "user_variable_8", [9] = "user_variable_9", [10] = "user_variable_10", [11] = "user_variable_11", [12] = "user_variable_12", [13] = "user_variable_13", [14] = "user_variable_14", [15] = "user_variable_15", [16] = "user_variable_16", [17] = "user_variable_17", [18] = "user_variable_18", [19] = "user_variable_19", [20] = "user_variable_20", [21] = "user_variable_21", [22] = "user_variable_22", [23] = "user_variable_23", [24] = "user_variable_24", [25] = "user_variable_25", [26] = "user_variable_26", [27] = "user_variable_27", [28] = "user_variable_28", [29] = "user_variable_29", [30] = "user_variable_30", [31] = "user_variable_31", [32] = "user_variable_32", [33] = "user_variable_33", [34] = "user_variable_34", [35] = "user_variable_35", [36] = "user_variable_36", [37] = "user_variable_37", [38] = "user_variable_38", [39] = "user_variable_39", [40] = "user_variable_40", [41] = "user_variable_41", [42] = "user_variable_42", [43] = "user_variable_43", [44] = "user_variable_44", [45] = "user_variable_45", [46] = "user_variable_46", [47] = "user_variable_47", [48] = "user_variable_48", [49] = "user_variable_49", [50] = "user_variable_50", [51] = "user_variable_51", [52] = "user_variable_52", [53] = "user_variable_53", [54] = "user_variable_54", [55] = "user_variable_55", [56] = "user_variable_56", [57] = "user_variable_57", [58] = "user_variable_58", [59] = "user_variable_59", [60] = "user_variable_60", [61] = "user_variable_61", [62] = "user_variable_62", [63] = "user_variable_63", [64] = "user_variable_64", [65] = "user_variable_65", [66] = "user_variable_66", [67] = "user_variable_67", [68] = "user_variable_68", [69] = "user_variable_69", [70] = "user_variable_70", [71] = "user_variable_71", [72] = "user_variable_72", [73] = "user_variable_73", [74] = "user_variable_74", [75] = "user_variable_75", [76] = "user_variable_76", [77] = "user_variable_77", [78] = "user_variable_78", [79] = "user_variable_79", [80] = "user_variable_80", [81] = "user_variable_81", [82] = "user_variable_82", [83] = "user_variable_83", [84] = "user_variable_84", [85] = "user_variable_85", [86] = "user_variable_86", [87] = "user_variable_87", [88] = "user_variable_88", [89] = "user_variable_89", [90] = "user_variable_90", [91] = "user_variable_91", [92] = "user_variable_92", [93] = "user_variable_93", [94] = "user_variable_94", [95] = "user_variable_95", [96] = "user_variable_96", [97] = "user_variable_97", [98] = "user_variable_98", [99] = "user_variable_99", [100] = "user_variable_100", [101] = "user_variable_101", [102] = "user_variable_102", [103] = "user_variable_103", [104] = "user_variable_104", [105] = "user_variable_105", [106] = "user_variable_106", [107] = "user_variable_107", [108] = "user_variable_108", [109] = "user_variable_109", [110] = "user_variable_110", [111] = "user_variable_111", [112] = "user_variable_112", [113] = "user_variable_113", [114] = "user_variable_114", [115] = "user_variable_115", [116] = "user_variable_116", [117] = "user_variable_117", [118] = "user_variable_118", [119] = "user_variable_119", [120] = "user_variable_120", [121] = "user_variable_121", [122] = "user_variable_122", [123] = "user_variable_123", [124] = "user_variable_124", [125] = "user_variable_125", [126] = "user_variable_126", [127] = "user_variable_127", [128] = "user_variable_128", [129] = "user_variable_129", [130] = "user_variable_130", [131] = "user_variable_131", [132] = "user_variable_132", [133] = "user_variable_133", [134] = "user_variable_134", [135] = "user_variable_135", [136] = "user_variable_136", [137] = "user_variable_137", [138] = "user_variable_138", [139] = "user_variable_139", [140] = "user_variable_140", [141] = "user_variable_141", [142] = "user_variable_142", [143] = "user_variable_143", [144] = "user_variable_144", [145] = "user_variable_145", [146] = "user_variable_146", [147] = "user_variable_147", [148] = "user_variable_148", [149] = "user_variable_149", [150] = "user_variable_150", [151] = "user_variable_151", [152] = "user_variable_152", [153] = "user_variable_153", [154] = "user_variable_154", [155] = "user_variable_155", [156] = "user_variable_156", [157] = "user_variable_157", [158] = "user_variable_158", [159] = "user_variable_159", [160] = "user_variable_160", [161] = "user_variable_161", [162] = "user_variable_162", [163] = "user_variable_163", [164] = "user_variable_164", [165] = "user_variable_165", [166] = "user_variable_166", [167] = "user_variable_167", [168] = "user_variable_168", [169] = "user_variable_169", [170] = "user_variable_170", [171] = "user_variable_171", [172] = "user_variable_172", [173] = "user_variable_173", [174] = "user_variable_174", [175] = "user_variable_175", [176] = "user_variable_176", [177] = "user_variable_177", [178] = "user_variable_178", [179] = "user_variable_179", [180] = "user_variable_180", [181] = "user_variable_181", [182] = "user_variable_182", [183] = "user_variable_183", [184] = "user_variable_184", [185] = "user_variable_185", [186] = "user_variable_186", [187] = "user_variable_187", [188] = "user_variable_188", [189] = "user_variable_189", [190] = "user_variable_190", [191] = "user_variable_191", [192] = "user_variable_192", [193] = "user_variable_193", [194] = "user_variable_194", [195] = "user_variable_195", [196] = "user_variable_196", [197] = "user_variable_197", [198] = "user_variable_198", [199] = "user_variable_199", [200] = "user_variable_200", [201] = "user_variable_201", [202] = "user_variable_202", [203] = "user_variable_203", [204] = "user_variable_204", [205] = "user_variable_205", [206] = "user_variable_206", [207] = "user_variable_207", [208] = "user_variable_208", [209] = "user_variable_209", [210] = "user_variable_210", [211] = "user_variable_211", [212] = "user_variable_212", [213] = "user_variable_213", [214] = "user_variable_214", [215] = "user_variable_215", [216] = "user_variable_216", [217] = "user_variable_217", [218] = "user_variable_218", [219] = "user_variable_219", [220] = "user_variable_220", [221] = "user_variable_221", [222] = "user_variable_222", [223] = "user_variable_223", [224] = "user_variable_224", [225] = "user_variable_225", [226] = "user_variable_226", [227] = "user_variable_227", [228] = "user_variable_228", [229] = "user_variable_229", [230] = "user_variable_230", [231] = "user_variable_231", [232] = "user_variable_232", [233] = "user_variable_233", [234] = "user_variable_234", [235] = "user_variable_235", [236] = "user_variable_236", [237] = "user_variable_237", [238] = "user_variable_238", [239] = "user_variable_239", [240] = "user_variable_240", [241] = "user_variable_241", [242] = "user_variable_242", [243] = "user_variable_243", [244] = "user_variable_244", [245] = "user_variable_245", [246] = "user_variable_246", [247] = "user_variable_247", [248] = "user_variable_248", [249] = "user_variable_249", [250] = "user_variable_250", [251] = "user_variable_251", [252] = "user_variable_252", [253] = "user_variable_253", [254] = "user_variable_254", [255] = "user_variable_255", },
        [3] = { },
    },
    ["TMCM-351"] = {
        [0] = { [64] = "eeprom_magic", [65] = "rs232_rs485_baud_rate", [66] = "serial_address", [67] = "ascii_mode", [68] = "serial_heartbeat", [69] = "can_bit_rate", [70] = "can_reply_id", [71] = "can_id", [73] = "configuration_eeprom_lock_flag", [75] = "telegram_pause_time", [76] = "serial_host_address", [77] = "auto_start_mode", [80] = "shutdown_pin_functionality", [81] = "tmcl_code_protection", [82] = "can_heartbeat", [83] = "can_secondary_address", [84] = "coordinate_storage", [85] = "do_not_restore_user_variables", [87] = "serial_secondary_address", [128] = "tmcl_application_status", [129] = "download_mode", [130] = "tmcl_program_counter", [131] = "last_tmcl_error", [132] = "tick_timer", [133] = "random_number", },
        [2] = { [0] = "user_variable_0", [1] = "user_variable_1", [2] = "user_variable_2", [3] = "user_variable_3", [4] = "user_variable_4", [5] = "user_variable_5", [6] = "user_variable_6", [7] = "user_variable_7", [8] = "user_variable_8", [9] = "user_variable_9", [10] = "user_variable_10", [11] = "user_variable_11", [12] = "user_variable_12", [13] = "user_variable_13", [14] = "user_variable_14", [15] = "user_variable_15", [16] = "user_variable_16", [17] = "user_variable_17", [18] = "user_variable_18", [19] = "user_variable_19", [20] = "user_variable_20", [21] = "user_variable_21", [22] = "user_variable_22", [23] = "user_variable_23", [24] = "user_variable_24", [25] = "user_variable_25", [26] = "user_variable_26", [27] = "user_variable_27", [28] = "user_variable_28", [29] = "user_variable_29", [30] = "user_variable_30", [31] = "user_variable_31", [32] = "user_variable_32", [33] = "user_variable_33", [34] = "user_variable_34", [35] = "user_variable_35", [36] = "user_variable_36", [37] = "user_variable_37", [38] = "user_variable_38", [39] = "user_variable_39", [40] = "user_variable_40", [41] = "user_variable_41", [42] = "user_variable_42", [43] = "user_variable_43", [44] = "user_variable_44", [45] = "user_variable_45", [46] = "user_variable_46", [47] = "user_variable_47", [48] = "user_variable_48", [49] = "user_variable_49", [50] = "user_variable_50", [51] = "user_variable_51", [52] = "user_variable_52", [53] = "user_variable_53", [54] = "user_variable_54", [55] = "user_variable_55", [56] = "user_variable_56", [57] = "user_variable_57", [58] = "user_variable_58", [59] = "user_variable_59", [60] = "user_variable_60", [61] = "user_variable_61", [62] = "user_variable_62", [63] = "user_variable_63", [64] = "user_variable_64", [65] = "user_variable_65", [66] = "user_variable_66", [67] = "user_variable_67", [68] = "user_variable_68", [69] = "user_variable_69", [70] = "user_variable_70", [71] = "user_variable_71", [72] = "user_variable_72", [73] = "user_variable_73", [74] = "user_variable_74", [75] = "user_variable_75", [76] = "user_variable_76", [77] = "user_variable_77", [78] = "user_variable_78", [79] = "user_variable_79", [80] = "user_variable_80", [81] = "user_variable_81", [82] = "user_variable_82", [83] = "user_variable_83", [84] = "user_variable_84", [85] = "user_variable_85", [86] = "user_variable_86", [87] = "user_variable_87", [88] = "user_variable_88", [89] = "user_variable_89", [90] = "user_variable_90", [91] = "user_variable_91", [92] = "user_variable_92", [93] = "user_variable_93", [94] = "user_variable_94", [95] = "user_variable_95", [96] = "user_variable_96", [97] = "user_variable_97", [98] = "user_variable_98", [99] = "user_variable_99", [100] = "user_variable_100", [101] = "user_variable_101", [102] = "user_variable_102", [103] = "user_variable_103", [104] = "user_variable_104", [105] = "user_variable_105", [106] = "user_variable_106", [107] = "user_variable_107", [108] = "user_variable_108", [109] = "user_variable_109", [110] = "user_variable_110", [111] = "user_variable_111", [112] = "user_variable_112", [113] = "user_variable_113", [114] = "user_variable_114", [115] = "user_variable_115", [116] = "user_variable_116", [117] = "user_variable_117", [118] = "user_variable_118", [119] = "user_variable_119", [120] = "user_variable_120", [121] = "user_variable_121", [122] = "user_variable_122", [123] = "user_variable_123", [124] = "user_variable_124", [125] = "user_variable_125", [126] = "user_variable_126", [127] = "user_variable_127", [128] = "user_variable_128", [129] = "user_variable_129", [130] = "user_variable_130", [131] = "user_variable_131", [132] = "user_variable_132", [133] = "user_variable_133", [134] = "user_variable_134", [135] = "user_variable_135", [136] = "user_variable_136", [137] = "user_variable_137", [138] = "user_variable_138", [139] = "user_variable_139", [140] = "user_variable_140", [141] = "user_variable_141", [142] = "user_variable_142", [143] = "user_variable_143", [144] = "user_variable_144", [145] = "user_variable_145", [146] = "user_variable_146", [147] = "user_variable_147", [148] = "user_variable_148", [149] = "user_variable_149", [150] = "user_variable_150", [151] = "user_variable_151", [152] = "user_variable_152", [153] = "user_variable_153", [154] = "user_variable_154", [155] = "user_variable_155", [156] = "user_variable_156", [157] = "user_variable_157", [158] = "user_variable_158", [159] = "user_variable_159", [160] = "user_variable_160", [161] = "user_variable_161", [162] = "user_variable_162", [163] = "user_variable_163", [164] = "user_variable_164", [165] = "user_variable_165", [166] = "user_variable_166", [167] = "user_variable_167", [168] = "user_variable_168", [169] = "user_variable_169", [170] = "user_variable_170", [171] = "user_variable_171", [172] = "user_variable_172", [173] = "user_variable_173", [174] = "user_variable_174", [175] = "user_variable_175", [176] = "user_variable_176", [177] = "user_variable_177", [178] = "user_variable_178", [179] = "user_variable_179", [180] = "user_variable_180", [181] = "user_variable_181", [182] = "user_variable_182", [183] = "user_variable_183", [184] = "user_variable_184", [185] = "user_variable_185", [186] = "user_variable_186", [187] = "user_variable_187", [188] = "user_variable_188", [189] = "user_variable_189", [190] = "user_variable_190", [191] = "user_variable_191", [192] = "user_variable_192", [193] = "user_variable_193", [194] = "user_variable_194", [195] = "user_variable_195", [196] = "user_variable_196", [197] = "user_variable_197", [198] = "user_variable_198", [199] = "user_variable_199", [200] = "user_variable_200", [201] = "user_variable_201", [202] = "user_variable_202", [203] = "user_variable_203", [204] = "user_variable_204", [205] = "user_variable_205", [206] = "user_variable_206", [207] = "user_variable_207", [208] = "user_variable_208", [209] = "user_variable_209", [210] = "user_variable_210", [211] = "user_variable_211", [212] = "user_variable_212", [213] = "user_variable_213", [214] = "user_variable_214", [215] = "user_variable_215", [216] = "user_variable_216", [217] = "user_variable_217", [218] = "user_variable_218", [219] = "user_variable_219", [220] = "user_variable_220", [221] = "user_variable_221", [222] = "user_variable_222", [223] = "user_variable_223", [224] = "user_variable_224", [225] = "user_variable_225", [226] = "user_variable_226", [227] = "user_variable_227", [228] = "user_variable_228", [229] = "user_variable_229", [230] = "user_variable_230", [231] = "user_variable_231", [232] = "user_variable_232", [233] = "user_variable_233", [234] = "user_variable_234", [235] = "user_variable_235", [236] = "user_variable_236", [237] = "user_variable_237", [238] = "user_variable_238", [239] = "user_variable_239", [240] = "user_variable_240", [241] = "user_variable_241", [242] = "user_variable_242", [243] = "user_variable_243", [244] = "user_variable_244", [245] = "user_variable_245", [246] = "user_variable_246", [247] = "user_variable_247", [248] = "user_variable_248", [249] = "user_variable_249", [250] = "user_variable_250", [251] = "user_variable_251", [252] = "user_variable_252", [253] = "user_variable_253", [254] = "user_variable_254", [255] = "user_variable_255", },
        [3] = { [0] = "timer_0_period", [1] = "timer_1_period", [2] = "timer_2_period", [27] = "stop_left_0_trigger_transition", [28] = "stop_right_0_trigger_transition", [29] = "stop_left_1_trigger_transition", [30] = "stop_right_1_trigger_transition", [31] = "stop_left_2_trigger_transition", [32] = "stop_right_2_trigger_transition", [39] = "input_0_trigger_transition", [40] = "input_1_trigger_transition", [41] = "input_2_trigger_transition", [42] = "input_3_trigger_transition", [43] = "input_4_trigger_transition", [44] = "input_5_trigger_transition", [45] = "input_6_trigger_transition", [46] = "input_7_trigger_transition", },
    },
}
-- =====================================================================================================================

local STATUS = {
    [1] = "wrong checksum", [2] = "invalid command", [3] = "wrong type", [4] = "invalid value", [5] = "EEPROM locked",
    [6] = "command not available", [100] = "ok", [101] = "command loaded", [128] = "position reached",
}

local modules = {}
for name in pairs(AXIS) do modules[#modules + 1] = name end
table.sort(modules)
local choices = {}
for index, name in ipairs(modules) do choices[index] = { index, name, index } end
local default = 1
for index, name in ipairs(modules) do if name == "TMCM-3351" then default = index end end
tmcl.prefs.module = Pref.enum("Module", default, "Whose parameters are named", choices)

local f = {
    address = ProtoField.uint16("tmcl.address", "Address"),
    command = ProtoField.uint8("tmcl.command", "Command", base.DEC, COMMAND),
    kind = ProtoField.uint8("tmcl.type", "Type"),
    motor = ProtoField.uint8("tmcl.motor", "Motor or bank"),
    value = ProtoField.int32("tmcl.value", "Value"),
    host = ProtoField.uint8("tmcl.host", "Host address"),
    status = ProtoField.uint8("tmcl.status", "Status", base.DEC, STATUS),
    checksum = ProtoField.uint8("tmcl.checksum", "Checksum", base.HEX),
    text = ProtoField.string("tmcl.text", "Version"),
    parameter = ProtoField.string("tmcl.parameter", "Parameter"),
    reply = ProtoField.bool("tmcl.reply", "Reply"),
}
tmcl.fields = f

local bad_checksum = ProtoExpert.new("tmcl.bad_checksum", "Wrong checksum", expert.group.CHECKSUM, expert.severity.ERROR)
tmcl.experts = { bad_checksum }

local VERSION, READ_MEMORY = 136, 134

-- The request before each packet, by packet number: what a reply means depends on it. The first pass is in order.
local before = {}
local latest

function tmcl.init()
    before, latest = {}, nil
end

local function parameter(command, kind, motor)
    local module = modules[tmcl.prefs.module]
    if READS_AXIS[command] then
        local name = AXIS[module][kind]
        return name and name .. " of axis " .. motor
    elseif READS_GLOBAL[command] then
        local bank = GLOBAL[module][motor]
        return bank and bank[kind]
    end
end

local function graphic(body)
    for index = 0, body:len() - 1 do
        local byte = body(index, 1):uint()
        if byte < 33 or byte > 126 then return false end
    end
    return true
end

-- True if a body (status, command, value behind an address) answers the latest request.
local function answers(body)
    local request = latest
    if not request then return false end
    if request.command == VERSION and request.kind == 0 then return graphic(body) end
    return STATUS[body(1, 1):uint()] ~= nil and body(2, 1):uint() == request.command
end

local function show_request(body, tree)
    local command, kind, motor, value = body(0, 1):uint(), body(1, 1):uint(), body(2, 1):uint(), body(3, 4):int()
    tree:add(f.command, body(0, 1))
    tree:add(f.kind, body(1, 1))
    tree:add(f.motor, body(2, 1))
    tree:add(f.value, body(3, 4))
    local name = parameter(command, kind, motor)
    if name then tree:add(f.parameter, name):set_generated() end
    local text = string.format("%s %d, %d, %d", COMMAND[command] or command, kind, motor, value)
    return name and text .. "  " .. name or text, { command = command, kind = kind, motor = motor }
end

local function show_reply(body, tree, request)
    tree:add(f.reply, true):set_generated()
    if request and request.command == VERSION and request.kind == 0 and graphic(body) then
        tree:add(f.text, body)
        return body:string()
    elseif request and request.command == READ_MEMORY then
        return (show_request(body(0, 7), tree))
    end
    local status, value = body(1, 1):uint(), body(3, 4):int()
    tree:add(f.address, body(0, 1))
    tree:add(f.status, body(1, 1))
    tree:add(f.command, body(2, 1))
    tree:add(f.value, body(3, 4))
    local name = request and request.command == body(2, 1):uint() and parameter(request.command, request.kind, request.motor)
    if name then tree:add(f.parameter, name):set_generated() end
    local text = string.format("%d (%s) %d", status, STATUS[status] or "unknown status", value)
    return name and text .. "  " .. name or text
end

-- One datagram: `body` is what stands behind the first address.
local function show(body, is_reply, pinfo, tree)
    if not pinfo.visited then before[pinfo.number] = latest end
    local request = before[pinfo.number]
    local text
    if is_reply then
        text = "< " .. show_reply(body, tree, request)
    else
        text, latest = show_request(body, tree)
        text = "> " .. text
    end
    pinfo.cols.protocol = "TMCL"
    pinfo.cols.info = text
    tree:append_text(": " .. text)
end

local function sum(bytes)
    local total = 0
    for index = 0, 7 do total = (total + bytes(index, 1):uint()) % 256 end
    return total
end

-- Nine bytes of a serial line or of TCP. `is_reply` is nil where nobody knows the direction.
local function serial(bytes, is_reply, pinfo, root)
    local tree = root:add(tmcl, bytes)
    if bytes:len() ~= 9 then
        tree:append_text(": " .. bytes:len() .. " bytes, not a datagram")
        pinfo.cols.protocol = "TMCL"
        return
    end
    if is_reply == nil then is_reply = bytes(2, 1):uint() == 128 or answers(bytes(1, 8)) end
    tree:add(is_reply and f.host or f.address, bytes(0, 1))
    local request = pinfo.visited and before[pinfo.number] or latest
    local is_text = is_reply and request and request.command == VERSION and request.kind == 0
    show(is_text and bytes(1, 8) or bytes(1, 7), is_reply, pinfo, tree)
    if not is_text then
        local item = tree:add(f.checksum, bytes(8, 1))
        if sum(bytes) ~= bytes(8, 1):uint() then item:add_proto_expert_info(bad_checksum) end
    end
end

function tmcl.dissector(buffer, pinfo, root)
    local is_reply
    if pinfo.p2p_dir == P2P_DIR_RECV then is_reply = true elseif pinfo.p2p_dir == P2P_DIR_SENT then is_reply = false end
    serial(buffer(), is_reply, pinfo, root)
    return buffer:len()
end
DissectorTable.get("wtap_encap"):add(wtap.USER0, tmcl)

local over_tcp = Proto("tmcl_tcp", "TMCL over TCP")
function over_tcp.dissector(buffer, pinfo, root)
    local whole = buffer:len() - buffer:len() % 9
    for start = 0, whole - 9, 9 do
        serial(buffer(start, 9), pinfo.src_port == pinfo.match_uint, pinfo, root)
    end
    if whole < buffer:len() then
        pinfo.desegment_offset, pinfo.desegment_len = whole, 9 - (buffer:len() - whole)
    end
    return buffer:len()
end
DissectorTable.get("tcp.port"):add(4322, over_tcp)

-- Frames of seven or eight bytes on CAN that look like a command or like the answer to the one before.
local function on_can(buffer, pinfo, root)
    if buffer:len() ~= 7 and buffer:len() ~= 8 then return false end
    local is_reply = pinfo.p2p_dir == P2P_DIR_RECV
    if pinfo.p2p_dir ~= P2P_DIR_RECV and pinfo.p2p_dir ~= P2P_DIR_SENT then
        is_reply = pinfo.visited and before[pinfo.number] ~= nil and before[pinfo.number].can_reply or answers(buffer())
    end
    if not is_reply and not COMMAND[buffer(0, 1):uint()] then return false end
    show(buffer(), is_reply, pinfo, root:add(tmcl, buffer()))
    return true
end
tmcl:register_heuristic("can", on_can)
