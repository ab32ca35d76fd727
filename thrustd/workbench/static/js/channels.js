// The channels that a column may be: roles first, what they mean, their units.

export const ROLES = ["time_s", "force_N", "deformation_mm"];
export const OTHERS = [
  "temperature_degC",
  "accel_x_g",
  "accel_y_g",
  "accel_z_g",
  "vibration_mm_s",
  "n1_pct",
  "n2_pct",
].concat(["fuel_flow_kg_s", "dynamic_pressure_Pa", "mach", "pressure_altitude_m", "pitch_deg"]);
export const MEANT = {
  time_s: "time",
  force_N: "reference force, forward thrust +",
  deformation_mm: "deformation, loaded by forward thrust +",
  accel_x_g: "specific force, forward +",
  accel_y_g: "specific force, right +",
  accel_z_g: "specific force, up +: 1 in level flight",
  pitch_deg: "nose up +",
};
const UNITS = {
  force_N: "N",
  deformation_mm: "mm",
  temperature_degC: "degC",
  vibration_mm_s: "mm/s",
  time_s: "s",
  mach: "-",
};
export const unitOf = (ours) =>
  UNITS[ours] ?? { g: "g", pct: "%", Pa: "Pa", m: "m", s: "kg/s", deg: "deg" }[ours.split("_").pop()] ?? "";
