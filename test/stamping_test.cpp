#include "rio_t/ros/cloud/stamping.h"

#include <gtest/gtest.h>

namespace rio_t {
namespace {

// The stamps run from 1000 s, the recording clock is 500 s ahead.
Time imuTime(double s) { return Time::fromSeconds(1000.0 + s); }
Time recordTime(double s) { return Time::fromSeconds(1500.0 + s); }

StampingOptions options(StampSource source) {
  StampingOptions result;
  result.source = source;
  result.radar_topic = "/radar";
  result.trigger_topic = "/trigger";
  return result;
}

/// Stamps in seconds after 1000 s, rounded to microseconds.
std::vector<double> seconds(const std::vector<RadarScan>& scans) {
  std::vector<double> result;
  result.reserve(scans.size());
  for (const RadarScan& scan : scans) result.push_back(std::round((scan.stamp - imuTime(0)) * 1e6) / 1e6);
  return result;
}

void append(std::vector<RadarScan> more, std::vector<RadarScan>* all) {
  for (RadarScan& scan : more) all->push_back(std::move(scan));
}

/// Feeds 20 triggers, 0.1 s apart, and scans that arrive `delay` after theirs. `lost` is the trigger that
/// never comes. The IMU's records let time pass.
std::vector<RadarScan> runTriggers(ScanStamper& stamper, double delay, std::uint32_t scan_seq_from,
                                   bool header_stamped, int lost = -1) {
  std::vector<RadarScan> all;
  for (int ms = 0; ms < 2500; ++ms) {
    stamper.addImu(imuTime(1e-3 * ms), recordTime(1e-3 * ms));
    const int k = ms / 100;
    if (ms % 100 == 0 && k < 20 && k != lost) {
      stamper.addTrigger(static_cast<std::uint32_t>(7 + k), imuTime(0.1 * k), recordTime(1e-3 * ms));
    }
    const int delay_ms = static_cast<int>(std::lround(delay * 1e3));
    const int j = (ms - delay_ms) / 100;
    if (ms >= delay_ms && (ms - delay_ms) % 100 == 0 && j < 20) {
      stamper.addScan(scan_seq_from + static_cast<std::uint32_t>(j),
                      header_stamped ? imuTime(0.1 * j + 0.01) : Time(), recordTime(1e-3 * ms), RadarScan());
    }
    append(stamper.take(), &all);
  }
  append(stamper.finish(), &all);
  return all;
}

TEST(ClockMap, FollowsAClockThatJumpsEitherWay) {
  for (const double jump : {-30.0, 30.0}) {
    ClockMap clocks;
    for (int i = 0; i < 100; ++i) clocks.add(imuTime(0.01 * i), recordTime(0.01 * i + 0.002));
    for (int i = 100; i < 130; ++i) clocks.add(imuTime(0.01 * i), recordTime(0.01 * i + 0.002 + jump));
    EXPECT_NEAR(*clocks.toImuClock(recordTime(1.302 + jump)) - imuTime(1.3), 0.0, 1e-6) << jump;
  }
}

TEST(ClockMap, AFewLateSamplesAreNoJump) {
  ClockMap clocks;
  for (int i = 0; i < 100; ++i) clocks.add(imuTime(0.01 * i), recordTime(0.01 * i + (i > 90 ? 0.8 : 0.0)));
  EXPECT_NEAR(*clocks.toImuClock(recordTime(1.0)) - imuTime(1.0), 0.0, 1e-6);
}

TEST(Stamping, HeaderStampsAreKeptToTheNanosecondAndShifted) {
  StampingOptions with_shift = options(StampSource::kHeader);
  with_shift.shift = -0.0025;
  ScanStamper stamper(with_shift);
  RadarScan scan;
  scan.points.resize(3);
  stamper.addScan(1, Time::fromNanoseconds(1700000000123456789), recordTime(0), scan);
  const std::vector<RadarScan> scans = stamper.take();
  ASSERT_EQ(scans.size(), 1u);
  EXPECT_EQ(scans[0].stamp.nanoseconds(), 1700000000120956789);
  EXPECT_EQ(scans[0].points.size(), 3u);
  EXPECT_TRUE(stamper.take().empty());
}

TEST(Stamping, AShiftedStampThatNoMessageCanHoldIsGivenUp) {
  StampingOptions with_shift = options(StampSource::kHeader);
  with_shift.shift = -1.0;
  ScanStamper below(with_shift);
  below.addScan(1, Time::fromSeconds(0.5), recordTime(0), RadarScan());
  below.addScan(2, Time::fromSeconds(1.5), recordTime(1), RadarScan());
  const std::vector<RadarScan> scans = below.take();
  ASSERT_EQ(scans.size(), 1u);
  EXPECT_EQ(scans[0].stamp, Time::fromSeconds(0.5));
  EXPECT_EQ(below.takeGivenUp().at("stamp_out_of_range"), 1u);
  with_shift.shift = 2e9;
  ScanStamper above(with_shift);
  above.addScan(1, Time::fromSeconds(3e9), recordTime(0), RadarScan());
  EXPECT_TRUE(above.take().empty());
  EXPECT_EQ(above.takeGivenUp().at("stamp_out_of_range"), 1u);
}

TEST(Stamping, ZeroHeaderStampIsRefusedWithTheOtherSources) {
  ScanStamper stamper(options(StampSource::kHeader));
  try {
    stamper.addScan(1, Time(), recordTime(0), RadarScan());
    FAIL() << "a zero stamp was taken";
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("/radar"), std::string::npos) << message;
    EXPECT_NE(message.find("trigger"), std::string::npos) << message;
    EXPECT_NE(message.find("arrival"), std::string::npos) << message;
  }
  EXPECT_TRUE(stamper.take().empty());
  stamper.addScan(2, imuTime(1), recordTime(1), RadarScan());
  EXPECT_EQ(stamper.take().size(), 1u);
  EXPECT_TRUE(stamper.takeGivenUp().empty());
}

TEST(Stamping, ZeroTriggerStampIsRefusedWithTopicAndKey) {
  ScanStamper stamper(options(StampSource::kTrigger));
  try {
    stamper.addTrigger(7, Time(), recordTime(0));
    FAIL() << "a zero stamp was taken";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/trigger (trigger_topic)"), std::string::npos) << error.what();
  }
  // The trigger is left out: its scan has none, the next one has.
  stamper.addScan(7, Time(), recordTime(0.02), RadarScan());
  stamper.addTrigger(8, imuTime(0.1), recordTime(0.1));
  stamper.addScan(8, Time(), recordTime(0.12), RadarScan());
  EXPECT_EQ(seconds(stamper.finish()), std::vector<double>({0.1}));
  EXPECT_EQ(stamper.takeGivenUp().at("trigger_missing"), 1u);
}

TEST(Stamping, ArrivalIsCarriedOverByTheFastestImuMessage) {
  ScanStamper stamper(options(StampSource::kArrival));
  stamper.addScan(1, Time(), recordTime(0.2), RadarScan());
  EXPECT_TRUE(stamper.take().empty()) << "no IMU sample yet: the clocks are not known";
  stamper.addImu(imuTime(0.0), recordTime(0.020));
  EXPECT_EQ(seconds(stamper.take()), std::vector<double>({0.180}));
  stamper.addImu(imuTime(0.1), recordTime(0.103));  // the shortest delay
  stamper.addImu(imuTime(0.2), recordTime(0.250));
  stamper.addScan(2, Time(), recordTime(0.3), RadarScan());
  EXPECT_EQ(seconds(stamper.take()), std::vector<double>({0.297}));
}

TEST(Stamping, ArrivalFollowsClocksThatDrift) {
  ClockMap clocks;
  EXPECT_FALSE(clocks.toImuClock(recordTime(0)));
  // The recording clock gains 1 ms a second.
  for (int s = 0; s < 600; ++s) clocks.add(imuTime(s), recordTime(s * 1.001));
  const double error = *clocks.toImuClock(recordTime(600 * 1.001)) - imuTime(600);
  EXPECT_GT(error, 0.0);
  EXPECT_LT(error, 0.125);  // two minutes of drift; ten minutes of it would be 0.6 s
}

TEST(Stamping, ArrivalWithoutImuIsGivenUpAtTheEnd) {
  ScanStamper stamper(options(StampSource::kArrival));
  stamper.addScan(1, Time(), recordTime(0), RadarScan());
  EXPECT_TRUE(stamper.finish().empty());
  EXPECT_EQ(stamper.takeGivenUp().at("imu_missing"), 1u);
}

TEST(Stamping, TriggerOfTheSameSeqWinsOverALaterOne) {
  // Scans arrive after the next trigger, as on the real sensor.
  ScanStamper stamper(options(StampSource::kTrigger));
  const std::vector<double> stamps = seconds(runTriggers(stamper, 0.126, 7, false));
  ASSERT_EQ(stamps.size(), 20u);
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(stamps[k], 0.1 * k, 1e-9);
  EXPECT_TRUE(stamper.takeGivenUp().empty());
}

TEST(Stamping, ShiftIsAddedToTriggerStamps) {
  StampingOptions with_shift = options(StampSource::kTrigger);
  with_shift.shift = 0.015;
  ScanStamper stamper(with_shift);
  const std::vector<double> stamps = seconds(runTriggers(stamper, 0.05, 7, false));
  ASSERT_EQ(stamps.size(), 20u);
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(stamps[k], 0.1 * k + 0.015, 1e-9);
}

TEST(Stamping, ALostTriggerCostsItsScanOnly) {
  ScanStamper stamper(options(StampSource::kTrigger));
  const std::vector<double> stamps = seconds(runTriggers(stamper, 0.126, 7, false, 9));
  ASSERT_EQ(stamps.size(), 19u);
  for (const double stamp : stamps) EXPECT_GT(std::abs(stamp - 0.9), 0.01);
  EXPECT_EQ(stamper.takeGivenUp().at("trigger_missing"), 1u);
}

TEST(Stamping, AScanWhoseTriggerCameBeforeTheBagIsGivenUpNotMispaired) {
  ScanStamper stamper(options(StampSource::kTrigger));
  stamper.addTrigger(8, imuTime(0.1), recordTime(0.0));
  stamper.addScan(7, Time(), recordTime(0.02), RadarScan());  // its trigger, 7, was before the first message
  EXPECT_TRUE(stamper.take().empty());
  stamper.addScan(8, Time(), recordTime(0.12), RadarScan());
  EXPECT_EQ(seconds(stamper.take()), std::vector<double>({0.1}));
  EXPECT_EQ(stamper.takeGivenUp().at("trigger_missing"), 1u);
}

TEST(Stamping, ATriggerThatComesAfterItsScanIsWaitedFor) {
  ScanStamper stamper(options(StampSource::kTrigger));
  stamper.addTrigger(7, imuTime(0.0), recordTime(0.0));
  stamper.addScan(7, Time(), recordTime(0.03), RadarScan());
  EXPECT_EQ(stamper.take().size(), 1u);
  stamper.addScan(8, Time(), recordTime(0.13), RadarScan());
  stamper.addImu(imuTime(0.14), recordTime(0.14));
  EXPECT_TRUE(stamper.take().empty());
  stamper.addTrigger(8, imuTime(0.1), recordTime(0.15));
  EXPECT_EQ(seconds(stamper.take()), std::vector<double>({0.1}));
  EXPECT_TRUE(stamper.finish().empty());
  EXPECT_TRUE(stamper.takeGivenUp().empty());
}

// As a live node may hand them over: the trigger was received in time, but its thread was late.
TEST(Stamping, ATriggerIsNotGivenUpWhileTheImuRunsAhead) {
  ScanStamper stamper(options(StampSource::kTrigger));
  for (const std::uint32_t k : {0U, 1U}) {
    const double t = 0.1 * k;
    if (k == 0) stamper.addTrigger(7, imuTime(t), recordTime(t));
    stamper.addScan(7 + k, Time(), recordTime(t + 0.09), RadarScan());
    stamper.addImu(imuTime(t + 0.09), recordTime(t + 0.09));
    stamper.addImu(imuTime(t + 0.2), recordTime(t + 0.2));
    EXPECT_EQ(stamper.take().size(), 1U - k);
  }
  stamper.addTrigger(8, imuTime(0.1), recordTime(0.1));
  EXPECT_EQ(seconds(stamper.take()), std::vector<double>{0.1});
  EXPECT_TRUE(stamper.takeGivenUp().empty());
}

TEST(Stamping, ATriggerThatComes100MsAfterItsScanIsItsTriggerOnceTheyCountAlike) {
  for (const bool known : {true, false}) {
    ScanStamper stamper(options(StampSource::kTrigger));
    if (known) {
      stamper.addTrigger(7, imuTime(0.0), recordTime(0.0));
      stamper.addScan(7, Time(), recordTime(0.09), RadarScan());
      EXPECT_EQ(stamper.take().size(), 1u);
    }
    stamper.addScan(8, Time(), recordTime(0.19), RadarScan());
    stamper.addTrigger(8, imuTime(0.1), recordTime(0.29));
    EXPECT_EQ(seconds(stamper.take()), known ? std::vector<double>{0.1} : std::vector<double>{});
  }
}

TEST(Stamping, AClockOfReceiptThatIsSetBackCostsNoScan) {
  ScanStamper stamper(options(StampSource::kTrigger));
  std::vector<RadarScan> all;
  for (int ms = 0; ms < 4000; ++ms) {
    const Time record = recordTime(1e-3 * ms + (ms < 2095 ? 0.0 : -30.0));  // a scan waits for its trigger
    stamper.addImu(imuTime(1e-3 * ms), record);
    const auto seq = static_cast<std::uint32_t>(7 + ms / 100);
    if (ms % 100 == 90) stamper.addScan(seq, Time(), record, RadarScan());
    if (ms % 100 == 99) stamper.addTrigger(seq, imuTime(1e-3 * (ms - 99)), record);  // overtaken
    append(stamper.take(), &all);
  }
  append(stamper.finish(), &all);
  const std::vector<double> stamps = seconds(all);
  ASSERT_EQ(stamps.size(), 40u);
  for (int k = 0; k < 40; ++k) EXPECT_NEAR(stamps[k], 0.1 * k, 1e-9);
}

TEST(Stamping, AScanThatIsHandedOverLateDoesNotSetTheClockBack) {
  ScanStamper stamper(options(StampSource::kTrigger));
  stamper.addTrigger(7, imuTime(0.0), recordTime(0.0));
  stamper.addScan(7, Time(), recordTime(0.03), RadarScan());
  EXPECT_EQ(stamper.take().size(), 1u);
  stamper.addTrigger(8, imuTime(0.1), recordTime(0.1));
  stamper.addImu(imuTime(2.0), recordTime(2.0));
  stamper.addScan(8, Time(), recordTime(0.13), RadarScan());
  EXPECT_EQ(seconds(stamper.take()), std::vector<double>({0.1}));
}

TEST(Stamping, UnlikeSeqsPairTheLatestTriggerBeforeTheArrival) {
  ScanStamper stamper(options(StampSource::kTrigger));
  const std::vector<double> stamps = seconds(runTriggers(stamper, 0.05, 4000, false));
  ASSERT_EQ(stamps.size(), 20u);
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(stamps[k], 0.1 * k, 1e-9);
}

TEST(Stamping, UnlikeSeqsPairTheTriggerNearestToTheHeader) {
  // Scans arrive after the next trigger: only the header tells.
  ScanStamper stamper(options(StampSource::kTrigger));
  const std::vector<double> stamps = seconds(runTriggers(stamper, 0.126, 4000, true));
  ASSERT_EQ(stamps.size(), 20u);
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(stamps[k], 0.1 * k, 1e-9);
}

TEST(Stamping, HeaderFartherThanHalfAPeriodFromEveryTriggerIsGivenUp) {
  ScanStamper stamper(options(StampSource::kTrigger));
  const std::vector<double> stamps = seconds(runTriggers(stamper, 0.05, 4000, true, 9));
  EXPECT_EQ(stamps.size(), 19u);
  EXPECT_EQ(stamper.takeGivenUp().at("trigger_missing"), 1u);
}

TEST(Stamping, SeqsThatDoNotCountAreNotMatched) {
  ScanStamper stamper(options(StampSource::kTrigger));
  std::vector<RadarScan> all;
  for (int ms = 0; ms < 2000; ++ms) {
    stamper.addImu(imuTime(1e-3 * ms), recordTime(1e-3 * ms));
    if (ms % 100 == 0) stamper.addTrigger(0, imuTime(1e-3 * ms), recordTime(1e-3 * ms));
    if (ms % 100 == 60) stamper.addScan(0, Time(), recordTime(1e-3 * ms), RadarScan());
    append(stamper.take(), &all);
  }
  append(stamper.finish(), &all);
  const std::vector<double> stamps = seconds(all);
  ASSERT_EQ(stamps.size(), 20u);
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(stamps[k], 0.1 * k, 1e-9);
}

TEST(Stamping, ATriggerNodeThatStartsAnewIsFollowedAfterAFewScans) {
  ScanStamper stamper(options(StampSource::kTrigger));
  std::vector<RadarScan> all;
  for (int k = 0; k < 40; ++k) {
    const auto trigger_seq = static_cast<std::uint32_t>(k < 20 ? 500 + k : k - 20);
    stamper.addTrigger(trigger_seq, imuTime(0.1 * k), recordTime(0.1 * k));
    stamper.addScan(static_cast<std::uint32_t>(500 + k), Time(), recordTime(0.1 * k + 0.03), RadarScan());
    append(stamper.take(), &all);
  }
  append(stamper.finish(), &all);
  EXPECT_EQ(all.size(), 36u);
  EXPECT_EQ(stamper.takeGivenUp().at("trigger_missing"), 4u);
  EXPECT_NEAR(all.back().stamp - imuTime(0), 3.9, 1e-9);
}

TEST(Stamping, NoTriggerAtAllGivesUpEveryScanAndHoldsFew) {
  ScanStamper stamper(options(StampSource::kTrigger));
  std::uint64_t given_up = 0;
  for (std::uint64_t k = 0; k < 300; ++k) {
    stamper.addScan(static_cast<std::uint32_t>(k), Time(), recordTime(0.1 * static_cast<double>(k)),
                    RadarScan());
    EXPECT_TRUE(stamper.take().empty());
    given_up += stamper.takeGivenUp()["trigger_missing"];
    EXPECT_LE(k + 1 - given_up, 10u);
  }
  EXPECT_TRUE(stamper.finish().empty());
  EXPECT_EQ(given_up + stamper.takeGivenUp()["trigger_missing"], 300u);
}

TEST(Stamping, HeldScansAreBounded) {
  ScanStamper stamper(options(StampSource::kArrival));
  for (int k = 0; k < 57; ++k) stamper.addScan(0, Time(), recordTime(k), RadarScan());
  EXPECT_EQ(stamper.takeGivenUp().at("too_many_held"), 57u - ScanStamper::kMaxHeld);
  EXPECT_TRUE(stamper.finish().empty());
  EXPECT_EQ(stamper.takeGivenUp().at("imu_missing"), ScanStamper::kMaxHeld);
}

}  // namespace
}  // namespace rio_t
