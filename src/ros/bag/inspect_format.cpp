#include "inspect_format.h"

#include <algorithm>
#include <array>
#include <boost/algorithm/cxx11/any_of.hpp>
#include <boost/algorithm/string.hpp>
#include <cmath>
#include <exception>
#include <set>
#include <utility>

#include "../text.h"
#include "rio_t/core/quantile.h"
#include "rio_t/ros/cloud/point_cloud.h"

namespace rio_t {
namespace {

using sensor_msgs::PointCloud2;

const PointCloud2* firstWithPoints(const CloudTopic& topic) {
  for (const auto& message : topic.messages) {
    if (hasPoints(*message)) return message.get();
  }
  return nullptr;
}

/// The field of that name, in capitals or not.
std::string fieldNamed(const std::vector<std::string>& fields, const std::string& name) {
  for (const std::string& field : fields) {
    if (boost::algorithm::iequals(field, name)) return field;
  }
  return "";
}

/// Returns the field that has one of the words as its name, or else the first whose name contains one. It is
/// none of `taken`, and no standard deviation or the like.
std::string fieldLike(const std::vector<std::string>& fields, const std::vector<std::string>& words,
                      const std::vector<std::string>& taken = {}) {
  for (const std::string& word : words) {
    std::string named = fieldNamed(fields, word);
    if (!named.empty()) return named;
  }
  for (const std::string& word : words) {
    for (const std::string& field : fields) {
      const std::string lower = boost::algorithm::to_lower_copy(field);
      const auto has = [&](const std::string& part) { return lower.find(part) != std::string::npos; };
      const bool derived = has("std") || has("var") || has("noise") || has("bin") || has("idx");
      if (!derived && has(word) && std::find(taken.begin(), taken.end(), field) == taken.end()) return field;
    }
  }
  return "";
}

/// Returns all values of one field. The decoder reads the field as if it were the Doppler.
std::vector<double> valuesOf(const CloudTopic& topic, PointCloudFormat format, const std::string& field) {
  format.doppler = field;
  format.doppler_sign = 1;
  format.power_unit = PowerUnit::kNotSnr;
  std::vector<double> values;
  for (const RadarScan& scan : decodeAll(topic, format).scans) {
    for (const RadarPoint& point : scan.points) values.push_back(point.doppler);
  }
  return values;
}

/// Guesses the names of the fields if no preset fits. The names that the user has `configured` stay.
void guessFormat(const std::vector<std::string>& fields, const PointCloudOverrides& configured,
                 FormatProposal* proposal) {
  const auto either = [](const std::string& name, const std::string& guess) {
    return name.empty() ? guess : name;
  };
  const std::string doppler =
      either(configured.doppler, fieldLike(fields, {"doppler", "radial_speed", "range_rate", "rangerate",
                                                    "velocity", "vel", "speed", "v_r", "vr"}));
  if (doppler.empty()) {
    proposal->fault = "no field name looks like a Doppler (fields: " + proposal->fields + ")";
    proposal->to_do =
        "If a field holds the Doppler, name it: --set radar_field_doppler=FIELD. If none does, use a radar "
        "driver that publishes positions and Doppler as sensor_msgs/PointCloud2.";
    return;
  }
  using Names = std::vector<std::pair<const char*, std::string>>;
  const Names cartesian = {{"x", either(configured.x, fieldNamed(fields, "x"))},
                           {"y", either(configured.y, fieldNamed(fields, "y"))},
                           {"z", either(configured.z, fieldNamed(fields, "z"))}};
  const Names spherical = {
      {"azimuth", either(configured.azimuth, fieldLike(fields, {"azimuth"}))},
      {"elevation", either(configured.elevation, fieldLike(fields, {"elevation"}))},
      {"range", either(configured.range, fieldLike(fields, {"range", "distance"}, {doppler}))}};
  const auto complete = [](const Names& names) {
    return std::none_of(names.begin(), names.end(), [](const auto& name) { return name.second.empty(); });
  };
  const bool is_cartesian = complete(cartesian) && configured.coordinates != PointCoordinates::kSpherical;
  if (!is_cartesian && !complete(spherical)) {
    proposal->fault =
        "it has no position: neither x, y, z nor azimuth, elevation, range (fields: " + proposal->fields +
        ")";
    proposal->to_do =
        "Name the fields of the position, each by --set: radar_field_x=FIELD, radar_field_y, radar_field_z, "
        "or "
        "radar_field_azimuth, radar_field_elevation, radar_field_range.";
    return;
  }
  const std::string preset = is_cartesian ? "coloradar" : "ars548_hkust";
  proposal->keys.set("radar_format", preset,
                     "No preset has these fields; this one is near: " + proposal->fields);
  if (pointCloudPreset(preset).doppler != doppler) proposal->keys.set("radar_field_doppler", doppler);
  for (const auto& [name, field] : is_cartesian ? cartesian : spherical) {
    if (field != name) proposal->keys.set(std::string("radar_field_") + name, field);
  }
  const std::string power = fieldLike(fields, {"snr"});
  if (!power.empty()) {
    proposal->keys.set("radar_field_power", power);
    proposal->keys.set("radar_power_unit", "snr_db");
  }
  proposal->odd.push_back("no preset has the fields " + proposal->fields + "; " + doppler +
                          (configured.doppler.empty()
                               ? " is taken for the Doppler; if another field is, name it: "
                                 "--set radar_field_doppler=FIELD"
                               : " is the Doppler, as configured"));
}

/// Names each angle whose values are too large for radians. A driver may count azimuths up to a whole turn.
void findDegrees(const CloudTopic& topic, FormatProposal* proposal) {
  const PointCloudFormat& format = proposal->format;
  if (format.coordinates != PointCoordinates::kSpherical) return;
  constexpr double kShare = 0.9;  // of the points: some drivers write nonsense into a few
  std::string named;
  for (const auto& [field, largest] :
       {std::make_pair(format.azimuth, 2.0 * M_PI), std::make_pair(format.elevation, 0.5 * M_PI)}) {
    const std::vector<double> values = valuesOf(topic, format, field);
    const double low = quantile(values, 1.0 - kShare), high = quantile(values, kShare);
    if (std::max(-low, high) > largest)
      appendItem(&named,
                 field + " runs from " + fixedText(quantile(values, 0.0), 1) + " to " +
                     fixedText(quantile(values, 1.0), 1),
                 " and ");
  }
  if (named.empty()) return;
  proposal->fault = named + ": that looks like degrees; expected radians";
  proposal->to_do = "Let the radar driver write angles in radians, or x, y, z in metres, and record again.";
}

void resolve(FormatProposal* proposal) {
  ParameterEntries entries;
  for (const ProposedKey& key : proposal->keys.all())
    entries.push_back({key.key, key.value, "fields of the cloud"});
  proposal->format = pointCloudFormat(makeConfig(entries));
}

/// The unit in which the median is a usual signal to noise ratio, 5 to 60 dB.
PowerUnit unitOf(double median, PowerUnit of_preset) {
  constexpr double kLeast = 5.0, kMost = 60.0;
  for (const PowerUnit unit : {of_preset, PowerUnit::kSnrDb, PowerUnit::kSnrDeciDb, PowerUnit::kSnrLinear}) {
    const double db = toDecibel(median, unit);
    if (db >= kLeast && db <= kMost) return unit;
  }
  return PowerUnit::kNotSnr;
}

void findPower(const CloudTopic& topic, bool unit_is_configured, FormatProposal* proposal) {
  const PointCloudFormat& format = proposal->format;
  if (format.power_unit == PowerUnit::kNotSnr) {
    proposal->power = "no SNR is read";
    return;
  }
  const std::vector<double> values = valuesOf(topic, format, format.power);
  const double median = quantile(values, 0.5);
  const bool constant = quantile(values, 0.0) == quantile(values, 1.0);
  const PowerUnit unit = unit_is_configured ? format.power_unit
                         : constant         ? PowerUnit::kNotSnr
                                            : unitOf(median, format.power_unit);
  const std::string said = "the values of " + format.power + " have the median " + fixedText(median, 1);
  if (unit != format.power_unit) {
    proposal->keys.set("radar_power_unit", toString(unit),
                       "As " + toString(format.power_unit) + " they make no sense: " + said);
    proposal->odd.push_back(said + ", so they are read as " + toString(unit) + ", not as " +
                            toString(format.power_unit));
    resolve(proposal);
  }
  if (unit == PowerUnit::kNotSnr) {
    proposal->power = "no SNR is read";
    return;
  }
  std::vector<double> decibels;
  for (const RadarScan& scan : decodeAll(topic, proposal->format).scans) {
    for (const RadarPoint& point : scan.points) decibels.push_back(point.snr_db);
  }
  proposal->power = "SNR " + fixedText(quantile(decibels, 0.1), 0) + " to " +
                    fixedText(quantile(decibels, 0.9), 0) + " dB in " + format.power;
  const double minimum = EgoVelocityOptions().min_snr_db;
  if (quantile(decibels, 0.2) < minimum) {
    proposal->keys.set(
        "radar_min_snr_db", ParameterValue{std::floor(quantile(decibels, 0.02))},
        "More than a fifth of the points are below the default, " + fixedText(minimum, 0) + " dB.");
    proposal->odd.push_back("a fifth of the points have less than " + fixedText(minimum, 0) +
                            " dB, so radar_min_snr_db is lowered");
  }
}

}  // namespace

bool hasPoints(const PointCloud2& cloud) { return !cloud.data.empty() && !cloud.fields.empty(); }

DecodedClouds decodeAll(const CloudTopic& topic, const PointCloudFormat& format) {
  DecodedClouds clouds;
  for (const auto& message : topic.messages) {
    try {
      const DecodedScan decoded = decode(*message, format);
      clouds.scans.push_back(toRadarScan(decoded.cloud, Time()));
      clouds.points += decoded.cloud.size();
      clouds.padding += decoded.padding;
      clouds.points_not_finite += decoded.dropped_not_finite;
    } catch (const std::exception&) {
      clouds.scans.emplace_back();
    }
  }
  return clouds;
}

bool isCloudKey(const std::string& key) {
  static const std::set<std::string> others = {"radar_format", "radar_axes", "radar_coordinates",
                                               "radar_power_unit", "radar_cloud_size"};
  return boost::algorithm::starts_with(key, "radar_field_") || others.count(key) != 0;
}

FormatProposal proposeFormat(const CloudTopic& topic, const ParameterEntries& configured) {
  FormatProposal proposal;
  const PointCloud2* message = firstWithPoints(topic);
  if (message == nullptr) {
    proposal.fault = "all of its clouds are empty";
    proposal.to_do = "Look why the radar sees nothing, and record again.";
    return proposal;
  }
  const PointCloudOverrides known = makeConfig(configured).radar_overrides;
  const bool format_is_configured = isConfigured("radar_format", configured);
  const std::vector<std::string> fields = fieldNames(*message);
  proposal.fields = boost::algorithm::join(fields, ", ");
  proposal.fitting = fittingPresets(*message);
  if (proposal.fitting.empty() && !format_is_configured) {
    guessFormat(fields, known, &proposal);
    if (!proposal.fault.empty()) return proposal;
  } else if (!format_is_configured) {
    std::string why = "Fields: " + proposal.fields;
    if (proposal.fitting.size() > 1)
      why += ". These presets have them, too: " + boost::algorithm::join(proposal.fitting, ", ");
    proposal.keys.set("radar_format", proposal.fitting.front(), why);
  }
  if (!known.power.empty()) proposal.keys.set("radar_power_unit", "snr_db");
  for (const ParameterEntry& entry : configured) {
    if (isCloudKey(entry.key)) proposal.keys.set(entry.key, entry.value, "Given by --set.");
  }
  resolve(&proposal);
  if ((message->width == 0 || message->height == 0) && !proposal.format.size_from_data) {
    proposal.keys.set("radar_cloud_size", "from_data", "The driver leaves width or height at zero.");
    resolve(&proposal);
  }
  try {
    decode(*message, proposal.format);
  } catch (const std::exception& error) {
    proposal.fault = error.what();
    proposal.to_do =
        "Correct the driver, or say with --set how the cloud is to be read (docs/your_sensors.md, section "
        "7).";
    return proposal;
  }
  findDegrees(topic, &proposal);
  if (!proposal.fault.empty()) return proposal;
  findPower(topic, known.power_unit.has_value(), &proposal);
  return proposal;
}

bool correctAxes(const CloudReport& cloud, bool mirrored, const ParameterEntries& configured,
                 FormatProposal* proposal) {
  constexpr double kLooks = 0.4;  // a mean direction that is longer than this shows where the radar looks
  constexpr double kWider = 1.5;  // a field of view is wider in azimuth, by about this
  PointCloudFormat& format = proposal->format;
  if (format.coordinates != PointCoordinates::kCartesian) return false;
  if (makeConfig(configured).radar_overrides.axes) return false;
  const std::array<std::string, 3> fields = {format.x, format.y, format.z};
  const Eigen::Vector3d mean = cloudFromRfu(format.axes) * cloud.mean_direction;  // along the fields
  const int forward = format.axes == PointAxes::kForwardLeftUp ? 0 : 1;
  const auto name = [&](int field) { return fields[static_cast<std::size_t>(field)]; };
  const auto rename = [&](int field, int from) {
    proposal->keys.set(
        std::string("radar_field_") + "xyz"[field], name(from),
        mirrored ? "Two fields of the cloud are swapped." : "The radar looks along another field.");
  };
  int looks = 0;
  const double most = mean.maxCoeff(&looks);
  if (most > kLooks && looks != forward) {
    if (mirrored) {
      rename(forward, looks);
      rename(looks, forward);
      proposal->odd.push_back("the fields " + name(forward) + " and " + name(looks) +
                              " are swapped: the radar looks along " + name(looks) +
                              ", and the axes are left-handed");
    } else if (looks != 2) {
      const char* axes = looks == 0 ? "flu" : "rfu";
      proposal->keys.set("radar_axes", axes, "The radar looks along this forward axis.");
      proposal->odd.push_back("the radar looks along " + name(looks) + ", so its axes are " + axes +
                              ", not those of the preset");
    } else {  // forward is z, as for a camera
      proposal->keys.set("radar_axes", "flu", "The radar looks along z.");
      rename(0, 2);
      rename(1, 0);
      rename(2, 1);
      proposal->odd.push_back("the radar looks along " + name(2));
    }
    resolve(proposal);
    return true;
  }
  // The forward axis is correct. If the view is much narrower along the lateral axis than along the vertical
  // one, these two are swapped.
  if (mirrored && cloud.mean_direction.norm() > kLooks && cloud.spread.z() > kWider * cloud.spread.x()) {
    const int lateral = forward == 0 ? 1 : 0;
    rename(lateral, 2);
    rename(2, lateral);
    proposal->odd.push_back("the fields " + name(lateral) + " and " + name(2) +
                            " are swapped: the axes are left-handed");
    resolve(proposal);
    return true;
  }
  return false;
}

}  // namespace rio_t
