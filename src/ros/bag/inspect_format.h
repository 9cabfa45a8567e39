#pragma once

#include <string>
#include <vector>

#include "inspect_keys.h"
#include "inspect_recording.h"
#include "rio_t/inspection/cloud_report.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

struct FormatProposal {
  std::string fault;                 ///< one sentence that says why the cloud cannot be used; empty: it can
  std::string to_do;                 ///< what to do about the fault
  std::string fields;                ///< "x, y, z, doppler"
  std::vector<std::string> fitting;  ///< presets whose fields the cloud has
  PointCloudFormat format;
  ProposedKeys keys;
  std::vector<std::string> odd;  ///< sentences
  std::string power;             ///< what the values of the power field show, as one phrase
};

/// Whether a cloud has data and fields.
bool hasPoints(const sensor_msgs::PointCloud2& cloud);

/// Whether a key says how a cloud is read: its preset, fields, axes and units.
bool isCloudKey(const std::string& key);

/// Chooses preset, names of fields and unit of the power by the fields and their values. What the user has
/// `configured` comes first. Only the units of power and angles need more than the first cloud with points.
FormatProposal proposeFormat(const CloudTopic& topic, const ParameterEntries& configured);

/// Changes the format so that the radar looks along the forward axis, as `cloud` shows it. `mirrored`: the
/// axes are left-handed (see MountingSearch). Axes that the user has `configured` stay. Returns whether
/// anything changed.
bool correctAxes(const CloudReport& cloud, bool mirrored, const ParameterEntries& configured,
                 FormatProposal* proposal);

struct DecodedClouds {
  std::vector<RadarScan> scans;       ///< without stamps; empty if the cloud cannot be decoded
  std::size_t points = 0;             ///< in the scans
  std::size_t padding = 0;            ///< padding that the decoder dropped
  std::size_t points_not_finite = 0;  ///< other points that it dropped
};

DecodedClouds decodeAll(const CloudTopic& topic, const PointCloudFormat& format);

}  // namespace rio_t
