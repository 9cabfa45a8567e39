// Uses the estimator, the point type with PCL, the decoding of clouds and a message.
#include <ceres/problem.h>
#include <pcl/common/transforms.h>
#include <pcl_conversions/pcl_conversions.h>
#include <rio_t/TimeOffset.h>
#include <rio_t/odometry/radar_inertial_odometry.h>
#include <rio_t/ros/cloud/point_cloud.h>

#include <iostream>

int main() {
  const ceres::Problem problem;  // as for a factor of one's own
  rio_t::RadarInertialOdometry odometry{rio_t::OdometryOptions()};
  odometry.addImu({rio_t::Time::fromSeconds(1.0), Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)});
  odometry.process();

  rio_t::RadarScan scan;
  scan.points.push_back({Eigen::Vector3d(1.0, 2.0, 3.0), -0.5, 20.0});
  pcl::PointCloud<rio_t::RadarPointPcl> cloud;
  pcl::fromROSMsg(rio_t::toPointCloud2(scan, {0}), cloud);
  pcl::transformPointCloud(cloud, cloud, Eigen::Affine3f(Eigen::Translation3f(1.0F, 0.0F, 0.0F)));

  rio_t::TimeOffset message;
  message.offset = 0.03;
  std::cout << cloud.at(0).x << " " << cloud.at(0).doppler << " " << message.offset << " "
            << problem.NumResiduals() << "\n";
}
