#pragma once

#include <string>
#include <vector>

#include "inspect_keys.h"
#include "inspect_recording.h"
#include "rio_t/inspection/cloud_report.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// How a cloud is to be read.
struct FormatProposal {
  std::string fault;                 ///< why it cannot be used, as one sentence; empty: it can
  std::string to_do;                 ///< what to do about it
  std::string fields;                ///< "x, y, z, doppler"
  std::vector<std::string> fitting;  ///< presets whose fields are all there
  PointCloudFormat format;
  ProposedKeys keys;
  std::vector<std::string> odd;  ///< sentences
  std::string power;             ///< what the power field says, as one phrase
};

/// Whether a cloud shows what its fields hold.
bool hasPoints(const sensor_msgs::PointCloud2& cloud);

/// Whether a key says how a cloud is read: its preset, fields, axes and units.
bool isCloudKey(const std::string& key);

/// Chooses preset, names of fields and unit of the power from fields and values. What the user has
/// `configured` comes first. Only the unit of angles needs more than the first cloud with points.
FormatProposal proposeFormat(const CloudTopic& topic, const ParameterEntries& configured);

/// Turns the format so that the radar looks along the forward axis, as `cloud` shows it. `mirrored`: the axes
/// are left-handed (see MountingSearch). Axes that the user has `configured` stay. Returns whether anything
/// changed.
bool correctAxes(const CloudReport& cloud, bool mirrored, const ParameterEntries& configured,
                 FormatProposal* proposal);

struct DecodedClouds {
  std::vector<RadarScan> scans;  ///< without stamps; what cannot be decoded is empty
  std::size_t points = 0;        ///< in the scans
  std::size_t padding = 0;       ///< points, left out of the scans, as the next
  std::size_t points_not_finite = 0;
};

/// The clouds as the format reads them.
DecodedClouds decodeAll(const CloudTopic& topic, const PointCloudFormat& format);

}  // namespace rio_t
