# rio_t with ROS One (Ubuntu 22.04 or 24.04), built and tested in a catkin workspace. From the folder of the repository:
#   docker build -f docker/one.Dockerfile -t rio_t:one .                                 Ubuntu 24.04
#   docker build -f docker/one.Dockerfile -t rio_t:one --build-arg UBUNTU=22.04 .
#   docker run --rm -v $PWD:/data -w /data rio_t:one rosrun rio_t rio_t_bag run.bag --config irs --output-dir out
ARG UBUNTU=24.04
FROM ubuntu:${UBUNTU}
SHELL ["/bin/bash", "-c"]
ENV DEBIAN_FRONTEND=noninteractive

# As https://ros.packages.techfak.net tells. Ubuntu's own package of rosdep (python3-rosdep2) is too old for it.
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates curl && \
    install -d /etc/apt/keyrings && \
    curl -fsSL https://ros.packages.techfak.net/gpg.key -o /etc/apt/keyrings/ros-one-keyring.gpg && \
    source /etc/os-release && \
    echo "deb [signed-by=/etc/apt/keyrings/ros-one-keyring.gpg] https://ros.packages.techfak.net $VERSION_CODENAME main" \
      >/etc/apt/sources.list.d/ros-one.list && \
    apt-get update && apt-get install -y --no-install-recommends build-essential python3-rosdep ros-one-ros-base && \
    rosdep init && \
    echo "yaml https://ros.packages.techfak.net/ros-one.yaml one" >/etc/ros/rosdep/sources.list.d/1-ros-one.list

# The dependencies first: this layer stays as long as package.xml does.
COPY package.xml /workspace/src/rio_t/
RUN apt-get update && rosdep update && source /opt/ros/one/setup.bash && \
    rosdep install --from-paths /workspace/src --ignore-src --rosdistro one -y && rm -rf /var/lib/apt/lists/*

COPY . /workspace/src/rio_t
COPY docker/in_workspace.sh /
RUN source /opt/ros/one/setup.bash && /workspace/src/rio_t/docker/build_workspace.sh /workspace
ENTRYPOINT ["/in_workspace.sh"]
CMD ["bash"]
